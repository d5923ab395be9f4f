"""Maintenance of the cache of libraries: list, verify and remove entries."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..host.lock import held_by_nobody
from . import entry as entries
from .build import LOCK, UNFINISHED, remove, remove_leftovers, tree_size
from .entry import Damaged
from .folder import limit

#: Entries used within this time, s, are kept: a process may be about to load them.
_IN_USE = 60.0


@dataclass(frozen=True)
class Listed:
    """Listed entry: size in bytes, time of last use in s since 1970, problem or ""."""

    folder: Path
    bytes: int
    used: float
    problem: str
    about: dict[str, object]


def _folders(parent: Path) -> Iterator[Path]:
    with contextlib.suppress(OSError):
        for place in os.scandir(parent):
            if not place.name.startswith(".") and place.is_dir(follow_symlinks=False):
                yield Path(place.path)


def listed(parent: Path) -> list[Listed]:
    """List all entries, the most recently used first, and verify each by its checksum."""
    found = []
    for folder in _folders(parent):
        problem, about = "", {}
        try:
            entry = entries.read(folder)
            if entry is None:
                continue
            about = entry.about
            if not folder.name.endswith(str(about["key"])[:32]):
                problem = "its folder is named after another key"
        except Damaged as damage:
            problem = str(damage)
        found.append(Listed(folder, tree_size(folder), _last_used(folder), problem, about))
    return sorted(found, key=lambda one: -one.used)


def _last_used(folder: Path) -> float:
    for path in (folder / entries.ABOUT, folder):
        with contextlib.suppress(OSError):
            return path.stat().st_mtime
    return 0.0


def unfinished(parent: Path) -> int:
    """Number of builds in progress, or interrupted and not yet removed."""
    return sum(1 for _ in parent.glob(f"{UNFINISHED}*"))


def tidy(parent: Path, keep: Path) -> None:
    """Remove leftovers of killed processes, and the least recently used entries above the limit.

    `keep` is the new entry, which is never removed.  Never raises OSError.
    """
    remove_leftovers(parent)
    allowed = limit()
    sizes = {place: (_last_used(place), tree_size(place)) for place in _folders(parent)}
    total = sum(size for _, size in sizes.values())
    for place, (used, size) in sorted(sizes.items(), key=lambda one: one[1]):
        if total <= allowed:
            break
        if place != keep and time.time() - used > _IN_USE:
            remove(place)
            total -= size


def clean(parent: Path, unused: float = 0.0) -> tuple[int, int]:
    """Remove entries not used for `unused` s, leftovers and idle locks.

    Returns the number of removed entries and their bytes.  Builds of other processes are kept, and
    libraries that they have loaded remain usable.
    """
    count = size = 0
    now = time.time()
    for place in list(_folders(parent)):
        if now - _last_used(place) >= unused:
            size += remove(place)
            count += 1
    remove_leftovers(parent, age=0.0)
    for path in parent.glob(f".*{LOCK}"):
        with held_by_nobody(path) as idle:
            if idle:
                path.unlink(missing_ok=True)
    return count, size
