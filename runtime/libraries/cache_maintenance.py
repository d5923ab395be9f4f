"""Maintenance of the cache of libraries: list, verify and remove entries."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ..platform_support.file_lock import lock_if_free
from . import cache_entry as entries
from .cache_entry import DamagedEntryError
from .cache_folder import size_limit
from .library_build import LOCK_SUFFIX, UNFINISHED_PREFIX, remove, remove_leftovers, tree_size

#: Entries used within this time, s, are kept: a process may be about to load them.
_MIN_UNUSED_TIME = 60.0


@dataclass(frozen=True)
class ListedEntry:
    """Listed entry: size in bytes, time of last use in s since 1970, problem or ""."""

    folder: Path
    bytes: int
    used: float
    problem: str
    about: dict[str, object]


def _entry_folders(parent: Path) -> Iterator[Path]:
    with contextlib.suppress(OSError):
        for place in os.scandir(parent):
            if not place.name.startswith(".") and place.is_dir(follow_symlinks=False):
                yield Path(place.path)


def list_entries(parent: Path) -> list[ListedEntry]:
    """List all entries, the most recently used first, and verify each by its checksum."""
    rows = []
    for folder in _entry_folders(parent):
        problem, description = "", {}
        try:
            entry = entries.read(folder)
            if entry is None:
                continue
            description = entry.about
            if not folder.name.endswith(str(description["key"])[:32]):
                problem = "its folder is named after another key"
        except DamagedEntryError as damage:
            problem = str(damage)
        rows.append(
            ListedEntry(folder, tree_size(folder), _last_used(folder), problem, description)
        )
    return sorted(rows, key=lambda one: -one.used)


def _last_used(folder: Path) -> float:
    for path in (folder / entries.DESCRIPTION_FILE, folder):
        with contextlib.suppress(OSError):
            return path.stat().st_mtime
    return 0.0


def count_unfinished_builds(parent: Path) -> int:
    """Number of builds in progress, or interrupted and not yet removed."""
    return sum(1 for _ in parent.glob(f"{UNFINISHED_PREFIX}*"))


def limit_cache(parent: Path, keep: Path) -> None:
    """Remove leftovers of killed processes, and the least recently used entries above the limit.

    `keep` is the new entry, which is never removed.  Never raises OSError.
    """
    remove_leftovers(parent)
    max_size = size_limit()
    sizes = {place: (_last_used(place), tree_size(place)) for place in _entry_folders(parent)}
    total = sum(size for _, size in sizes.values())
    for place, (last_used, size) in sorted(sizes.items(), key=lambda one: one[1]):
        if total <= max_size:
            break
        if place != keep and time.time() - last_used > _MIN_UNUSED_TIME:
            remove(place)
            total -= size


def clean_cache(parent: Path, unused: float = 0.0) -> tuple[int, int]:
    """Remove entries not used for `unused` s, leftovers and idle locks.

    Returns the number of removed entries and their bytes.  Builds of other processes are kept, and
    libraries that they have loaded remain usable.
    """
    count = size = 0
    now = time.time()
    for place in list(_entry_folders(parent)):
        if now - _last_used(place) >= unused:
            size += remove(place)
            count += 1
    remove_leftovers(parent, age=0.0)
    for path in parent.glob(f".*{LOCK_SUFFIX}"):
        with lock_if_free(path) as is_idle:
            if is_idle:
                path.unlink(missing_ok=True)
    return count, size
