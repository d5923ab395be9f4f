"""Looking after the cache: what is in it, is it whole, what can go."""

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

#: What was used within this time, s, is being opened by somebody and stays.
_IN_USE = 60.0


@dataclass(frozen=True)
class Listed:
    """An entry as a list shows it: size in bytes, time of last use in s since 1970."""

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
    """All entries, the last used first; each is read and its checksum verified."""
    found = []
    for folder in _folders(parent):
        problem, about = "", {}
        try:
            entry = entries.read(folder)
            if entry is None:
                continue
            about = entry.about
            if not folder.name.endswith(str(about["key"])[:32]):
                problem = "its name is that of another key"
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
    """How many builds are under way, or were cut off and not yet tidied away."""
    return sum(1 for _ in parent.glob(f"{UNFINISHED}*"))


def tidy(parent: Path, keep: Path) -> None:
    """After a build: leftovers of killed processes go, and the least recently used entries
    beyond the limit.  `keep` stays.  Never raises."""
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

    Returns how many entries went, and their bytes.  What other processes are building stays, and
    what they have opened keeps working.
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
