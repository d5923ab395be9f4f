"""Cache of compiled libraries: one entry per content, shared by all processes of a user.

The key is a hash of everything that decides the machine code: the sources of the text, the flags,
the compiler (its file, not its version output: a hit runs no process), the processor, the platform,
mstmm.  No entry can therefore be out of date.  When the cache exceeds its limit, the least recently
used entries are removed.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from mstmm import version
from mstmm.abi.element_library import ABI_VERSION
from mstmm.errors import EnvironmentFailure

from ..platform_support.file_lock import lock_if_free
from . import toolchain
from .cache_files import (
    DESCRIPTION_FILE,
    FORMAT,
    VARIABLE,
    DamagedEntryError,
    private_folder,
    read_entry,
    size_limit,
)
from .library_build import (
    LOCK_SUFFIX,
    UNFINISHED_PREFIX,
    BuildOrder,
    BuiltLibrary,
    find_library,
    get_or_build,
    remove,
    remove_leftovers,
    tree_size,
)

__all__ = ["BuiltLibrary", "Recipe", "find", "library", "open_cached_library"]

T = TypeVar("T")


@dataclass(frozen=True)
class Recipe:
    """Recipe of a compiled library.

    Args:
        name: readable stem of its files, such as "fused".
        identity: everything that decides the text, available without generating it: hashes of the
            structure, of the generator and the kernels, the ABI of the descriptor, scalar type,
            lanes.
        sources: generates the text, file name -> content, for a key that the text may contain;
            runs only when a library is built.  Files that end in .c are compiled, others are only
            written to the same folder.
        flags: of the compiler, in addition to -fPIC and -shared.
        optional: flags that make code faster and are omitted if the compiler does not support
            them.
        symbols: names that the library must export.  If it also exports
            `int mstmm_self_test(void)`, that is called once after the build, in a separate
            process; 0 is success.
    """

    name: str
    identity: Mapping[str, str]
    sources: Callable[[str], Mapping[str, str]]
    flags: tuple[str, ...]
    symbols: tuple[str, ...] = ("mstmm_fused_library",)
    optional: tuple[str, ...] = ()


def find(recipe: Recipe) -> BuiltLibrary | None:
    """Find a valid library in the cache without compiling, else None.  Never raises."""
    try:
        place, order = _place_and_order(recipe)
        return find_library(place, order.key)
    except (EnvironmentFailure, DamagedEntryError):
        return None


def library(recipe: Recipe, *, timeout: float | None = None) -> BuiltLibrary:
    """Library of a recipe, from the cache or newly built.

    `timeout` limits the compiler, s (300 by default, $MSTMM_COMPILE_TIMEOUT overrides the default).
    Raises EnvironmentFailure, one line with a remedy: no compiler; one that fails, hangs or is
    killed; a cache folder that cannot be written, belongs to another user, or is full;
    an invalid $MSTMM_CACHE_SIZE.
    """
    size_limit()  # report an invalid limit before a compiler runs
    place, order = _place_and_order(recipe)
    built = get_or_build(place, order, toolchain.time_limit() if timeout is None else timeout)
    if built.how == "compiled":
        limit_cache(place.parent, keep=place)
    return built


def open_cached_library(
    recipe: Recipe,
    opener: Callable[[Path, str], T],
    *,
    known: BuiltLibrary | None = None,
    timeout: float | None = None,
) -> tuple[T, BuiltLibrary]:
    """Open the library of a recipe with `opener(path, key)`; rebuild it once if that fails.

    `known` is the result of a preceding `find`, which saves a second search.

    The opener raises OSError (it cannot be loaded) or EnvironmentFailure (unexpected ABI number or
    key) after closing the library.  Raises EnvironmentFailure if the rebuilt library fails too.
    """
    built = library(recipe, timeout=timeout) if known is None else known
    try:
        return opener(built.path, built.key), built
    except (OSError, EnvironmentFailure) as error:
        if built.how == "compiled":
            raise EnvironmentFailure(f"{built.path} cannot be used: {error}") from error
    remove(built.path.parent)
    built = library(recipe, timeout=timeout)
    try:
        return opener(built.path, built.key), built
    except OSError as error:
        raise EnvironmentFailure(f"{built.path} cannot be opened: {error}") from error


def _place_and_order(recipe: Recipe) -> tuple[Path, BuildOrder]:
    """Place of the library of a recipe in the cache, and its build order."""
    description = {
        "identity": dict(sorted(recipe.identity.items())),
        "flags": list(recipe.flags),
        "optional": list(recipe.optional),
        "compiler": toolchain.find_compiler().identity(),
        "processor": toolchain.processor_features(),
        "platform": f"{sys.platform} {os.uname().machine} {sys.byteorder} {sys.maxsize}",
        "mstmm": version.__version__,
        "abi": f"{FORMAT} {ABI_VERSION}",
    }
    key = hashlib.sha256(
        json.dumps([recipe.name, description], sort_keys=True).encode()
    ).hexdigest()
    order = BuildOrder(
        recipe.name, key, recipe.sources, recipe.flags, recipe.symbols, VARIABLE, description,
        recipe.optional,
    )  # fmt: skip
    return private_folder() / f"{recipe.name}-{key[:32]}", order


# --- maintenance: list, verify and remove entries -------------------------------------------------

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
            entry = read_entry(folder)
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
    for path in (folder / DESCRIPTION_FILE, folder):
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
