"""Build of libraries that many processes share: look up, lock, build, test, rename.

Used by the cache of fused libraries and by the store of user-defined elements.  Both pass a place
(the folder to be created) and an `BuildOrder`.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure

from . import toolchain
from .cache_files import DamagedEntryError, Entry, mark_used, read_entry, store_text, write_entry
from .toolchain import Compiler

#: Prefix of folders in which a library is being built.
UNFINISHED_PREFIX = ".building-"

#: Suffix of lock files.
LOCK_SUFFIX = ".lock"

#: A folder younger than this, s, counts as being built even if its lock is free.
_MIN_LEFTOVER_AGE = 60.0

#: Message of the loader on a file system without execute permission.
_NOEXEC_MESSAGE = "failed to map segment"
_DOCTOR_REMEDY = "see mstmm doctor"

_NO_SPACE_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True)
class BuildOrder:
    """Description of a library to build.

    `name` is the stem of the library's file name, `key` identifies all that decides its content.
    `sources` generates the texts, file name -> text, and runs only when a library is built.  Files
    that end in .c are compiled together with `flags`; flags in `optional` are omitted if the
    compiler does not support them.  The library must export `symbols`.
    `variable` names the environment variable by which a user chooses the folder.
    """

    name: str
    key: str
    sources: Callable[[str], Mapping[str, str]]
    flags: tuple[str, ...]
    symbols: tuple[str, ...]
    variable: str
    about: Mapping[str, Any] = field(default_factory=dict)
    optional: tuple[str, ...] = ()


@dataclass(frozen=True)
class BuiltLibrary:
    """Library that is ready to be loaded.

    `how` is "cached" or "compiled"; `seconds` is the compile time, s, also of a cached library;
    `note` is "" or a line for the user (a damaged library was replaced).
    """

    path: Path
    key: str
    how: str
    seconds: float
    note: str = ""


def find_library(place: Path, key: str) -> BuiltLibrary | None:
    """Find the library at `place`, None if there is none.  Raises Damaged if its check fails."""
    entry = read_entry(place, key)
    if entry is None:
        return None
    mark_used(entry)
    return _built_library(entry, "cached", "")


def _built_library(entry: Entry, how: str, note: str) -> BuiltLibrary:
    seconds = float(entry.about.get("seconds", 0.0))
    return BuiltLibrary(entry.library, str(entry.about["key"]), how, seconds, note)


#: Failed builds of this process: each fails at once when repeated, without a second timeout.
_failed_builds: dict[tuple[Path, str, Compiler], str] = {}


def get_or_build(place: Path, order: BuildOrder, timeout: float) -> BuiltLibrary:
    """Get the library at `place`; build it if it is missing or damaged.

    Raises EnvironmentFailure, one line with a remedy, if it cannot be built.  All files are removed
    then, and this process does not repeat the build with the same compiler.
    """
    built, _ = _find_or_damage(place, order.key)
    if built is not None:
        return built
    compiler = toolchain.find_compiler()
    attempt = (place, order.key, compiler)
    if attempt in _failed_builds:
        raise EnvironmentFailure(_failed_builds[attempt])
    try:
        return _build_locked(place, order, compiler, timeout)
    except EnvironmentFailure as error:
        _failed_builds[attempt] = str(error)
        raise
    except OSError as error:
        raise EnvironmentFailure(_write_error_text(place, order, error)) from None


def _find_or_damage(place: Path, key: str) -> tuple[BuiltLibrary | None, str]:
    """Library at `place` or None, and the damage of an entry there, or ""."""
    try:
        return find_library(place, key), ""
    except DamagedEntryError as damage:
        return None, str(damage)


def _build_locked(
    place: Path, order: BuildOrder, compiler: Compiler, timeout: float
) -> BuiltLibrary:
    from ..platform_support.file_lock import file_lock

    with file_lock(place.parent / f".{place.name}{LOCK_SUFFIX}", timeout) as remark:
        built, damage = _find_or_damage(
            place, order.key
        )  # perhaps built by the previous owner of the lock
        if built is not None:
            return built
        notes = [remark] if remark else []
        if damage:
            notes.append(f"the library {place.name} was rebuilt: {damage}")
        with _build_folder(place.parent) as folder:
            entry = _build_entry(folder, order, compiler, timeout)
            return _built_library(_move_entry(entry, place), "compiled", "; ".join(notes))


@contextlib.contextmanager
def _build_folder(parent: Path) -> Iterator[Path]:
    """Yield a temporary folder in the file system of `parent`, locked until the block ends."""
    import tempfile

    from ..platform_support.file_lock import file_lock

    outer_folder = Path(tempfile.mkdtemp(prefix=UNFINISHED_PREFIX, dir=parent))
    try:
        with file_lock(outer_folder / LOCK_SUFFIX, 0.0):
            entry_folder = outer_folder / "entry"
            entry_folder.mkdir(mode=0o700)
            yield entry_folder
    finally:
        shutil.rmtree(outer_folder, ignore_errors=True)


def _build_entry(folder: Path, order: BuildOrder, compiler: Compiler, timeout: float) -> Entry:
    """Write, compile and test a library and write its description, all inside `folder`."""
    work_folder = folder.parent / "work"
    work_folder.mkdir()
    texts = order.sources(order.key)
    for name, text in texts.items():
        (work_folder / name).write_text(text, encoding="utf-8")
    library = order.name + toolchain.library_suffix()
    sources = [work_folder / name for name in texts if name.endswith(".c")]
    compilation = toolchain.build(
        compiler, sources, folder / library, order.flags, order.optional, timeout
    )
    (folder / library).chmod(0o700)
    problem_text = _library_problem(folder / library, order.symbols)
    if problem_text:
        remedy = (
            f"set {order.variable} to another folder"
            if _NOEXEC_MESSAGE in problem_text
            else _DOCTOR_REMEDY
        )
        raise EnvironmentFailure(
            f"the library that the C compiler {compiler.command[0]} built from {sources[0].name} "
            f"cannot be used: {problem_text}; {remedy}"
        )
    store_text(folder, texts)
    description = {
        **order.about, "name": order.name, "key": order.key, "flags": list(compilation.flags),
        "seconds": round(compilation.seconds, 4), "compiler": compiler.identity(),
        "compiler_version": toolchain.compiler_version(compiler, work_folder),
        "created": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }  # fmt: skip
    return write_entry(folder, library, description)


def _move_entry(entry: Entry, place: Path) -> Entry:
    """Move a finished entry to its place by one rename; a damaged entry there is removed first."""
    for attempt in range(3):
        try:
            os.rename(entry.folder, place)
            return Entry(place, entry.about)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                raise
        # Another process without the lock was faster, or a damaged entry is there.
        with contextlib.suppress(DamagedEntryError):
            existing_entry = read_entry(place, str(entry.about["key"]))
            if existing_entry is not None:
                return existing_entry
        with contextlib.suppress(FileNotFoundError):
            os.rename(place, entry.folder.parent / f"replaced{attempt}")
    raise OSError(errno.EBUSY, "other processes write there repeatedly")


def _write_error_text(place: Path, order: BuildOrder, error: OSError) -> str:
    if error.errno in _NO_SPACE_ERRORS:
        return (
            f"no space for a compiled library in {place.parent} ({error.strerror}); "
            f"free some, or set {order.variable} to a folder with space"
        )
    return (
        f"nothing can be written to {place.parent} ({error.strerror}); "
        f"set {order.variable} to a folder that you own"
    )


def remove(place: Path) -> int:
    """Remove an entry atomically; returns its size in bytes.  Never raises OSError."""
    import tempfile

    size = tree_size(place)
    try:
        trash_folder = Path(tempfile.mkdtemp(prefix=UNFINISHED_PREFIX, dir=place.parent))
        with contextlib.suppress(OSError):
            os.rename(place, trash_folder / "removed")
        shutil.rmtree(trash_folder, ignore_errors=True)
    except OSError:
        shutil.rmtree(place, ignore_errors=True)
    return size


def remove_leftovers(parent: Path, age: float = _MIN_LEFTOVER_AGE) -> int:
    """Remove unfinished builds of killed processes; returns their number."""
    from ..platform_support.file_lock import lock_if_free

    count = 0
    for build_folder in parent.glob(f"{UNFINISHED_PREFIX}*"):
        with contextlib.suppress(OSError):
            if time.time() - build_folder.stat().st_mtime < age:
                continue
            with lock_if_free(build_folder / LOCK_SUFFIX) as is_abandoned:
                if is_abandoned:
                    shutil.rmtree(build_folder, ignore_errors=True)
                    count += 1
    return count


def tree_size(folder: Path) -> int:
    """Total size in bytes of the files in a folder and its subfolders."""
    total = 0
    for place, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(OSError):
                total += os.lstat(os.path.join(place, name)).st_size
    return total


# --- test in a separate process, so that a crash does not end this one ----------------------------
#
# The process returns 0 if the library opens, has its symbols, and its self-test, if any, returns 0.

#: Name of the self-test `int (void)` that a library may export; 0 is success.
_SELF_TEST_SYMBOL = "mstmm_self_test"

_SELF_TEST_TIMEOUT_S = 60.0

# Without site and with the standard library alone: about 12 ms.
_SELF_TEST_SCRIPT = f"""\
import ctypes, os, sys
library = ctypes.CDLL(sys.argv[1], os.RTLD_NOW)
for name in sys.argv[2:]:
    getattr(library, name)
test = getattr(library, {_SELF_TEST_SYMBOL!r}, None)
if test is not None and test() != 0:
    sys.exit("its self-test failed")
"""


def _library_problem(library: Path, symbols: Sequence[str]) -> str:
    """Reason that a library cannot be used, or ""; also "" if no test process can be started."""
    from ..platform_support.subprocesses import ProcessTimeout, run

    if not sys.executable:  # Python inside another program
        return ""
    try:
        result = run(
            [sys.executable, "-I", "-S", "-c", _SELF_TEST_SCRIPT, str(library), *symbols],
            library.parent,
            _SELF_TEST_TIMEOUT_S,
        )
    except ProcessTimeout:
        return f"it did not return within {_SELF_TEST_TIMEOUT_S:g} s"
    except OSError:
        return ""
    if result.code == 0:
        return ""
    if result.code < 0:
        return f"it crashes ({result.signal()})"
    lines = result.output.splitlines()
    return lines[-1].strip()[:300] if lines else f"its test ended with code {result.code}"
