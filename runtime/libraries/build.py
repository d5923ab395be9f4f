"""Build of libraries that many processes share: look up, lock, build, test, rename.

Used by the cache of fused libraries and by the store of user-defined elements.  Both pass a place
(the folder to be created) and an `Order`.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure

from . import entry as entries
from . import toolchain
from .entry import Damaged, Entry
from .toolchain import Compiler

#: Prefix of folders in which a library is being built.
UNFINISHED = ".building-"

#: Suffix of lock files.
LOCK = ".lock"

#: A folder younger than this, s, counts as being built even if its lock is free.
_FRESH = 60.0

#: Message of the loader on a file system without execute permission.
_NOEXEC = "failed to map segment"
_DOCTOR = "see mstmm doctor"

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True)
class Order:
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
class Built:
    """Library that is ready to be loaded.

    `how` is "cached" or "compiled"; `seconds` is the compile time, s, also of a cached library;
    `note` is "" or a line for the user (a damaged library was replaced).
    """

    path: Path
    key: str
    how: str
    seconds: float
    note: str = ""


def found(place: Path, key: str) -> Built | None:
    """Find the library at `place`, None if there is none.  Raises Damaged if its check fails."""
    entry = entries.read(place, key)
    if entry is None:
        return None
    entries.used(entry)
    return _built(entry, "cached", "")


def _built(entry: Entry, how: str, note: str) -> Built:
    seconds = float(entry.about.get("seconds", 0.0))
    return Built(entry.library, str(entry.about["key"]), how, seconds, note)


#: Failed builds of this process: each fails at once when repeated, without a second timeout.
_failed: dict[tuple[Path, str, Compiler], str] = {}


def fetched(place: Path, order: Order, timeout: float) -> Built:
    """Get the library at `place`; build it if it is missing or damaged.

    Raises EnvironmentFailure, one line with a remedy, if it cannot be built.  All files are removed
    then, and this process does not repeat the build with the same compiler.
    """
    built, _ = _look(place, order.key)
    if built is not None:
        return built
    compiler = toolchain.compiler()
    attempt = (place, order.key, compiler)
    if attempt in _failed:
        raise EnvironmentFailure(_failed[attempt])
    try:
        return _fetched_alone(place, order, compiler, timeout)
    except EnvironmentFailure as error:
        _failed[attempt] = str(error)
        raise
    except OSError as error:
        raise EnvironmentFailure(_unwritable(place, order, error)) from None


def _look(place: Path, key: str) -> tuple[Built | None, str]:
    """Library at `place` or None, and the damage of an entry there, or ""."""
    try:
        return found(place, key), ""
    except Damaged as damage:
        return None, str(damage)


def _fetched_alone(place: Path, order: Order, compiler: Compiler, timeout: float) -> Built:
    from ..host.lock import locked

    with locked(place.parent / f".{place.name}{LOCK}", timeout) as remark:
        built, damage = _look(place, order.key)  # perhaps built by the previous owner of the lock
        if built is not None:
            return built
        notes = [remark] if remark else []
        if damage:
            notes.append(f"the library {place.name} was rebuilt: {damage}")
        with _workshop(place.parent) as folder:
            entry = _made(folder, order, compiler, timeout)
            return _built(_moved(entry, place), "compiled", "; ".join(notes))


@contextlib.contextmanager
def _workshop(parent: Path) -> Iterator[Path]:
    """Yield a temporary folder in the file system of `parent`, locked until the block ends."""
    import tempfile

    from ..host.lock import locked

    outer = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=parent))
    try:
        with locked(outer / LOCK, 0.0):
            inner = outer / "entry"
            inner.mkdir(mode=0o700)
            yield inner
    finally:
        shutil.rmtree(outer, ignore_errors=True)


def _made(folder: Path, order: Order, compiler: Compiler, timeout: float) -> Entry:
    """Write, compile and test a library and write its description, all inside `folder`."""
    from . import self_test

    work = folder.parent / "work"
    work.mkdir()
    texts = order.sources(order.key)
    for name, text in texts.items():
        (work / name).write_text(text, encoding="utf-8")
    library = order.name + toolchain.library_suffix()
    sources = [work / name for name in texts if name.endswith(".c")]
    compilation = toolchain.build(
        compiler, sources, folder / library, order.flags, order.optional, timeout
    )
    (folder / library).chmod(0o700)
    wrong = self_test.problem(folder / library, order.symbols)
    if wrong:
        way_out = f"set {order.variable} to another folder" if _NOEXEC in wrong else _DOCTOR
        raise EnvironmentFailure(
            f"the library that the C compiler {compiler.command[0]} built from {sources[0].name} "
            f"cannot be used: {wrong}; {way_out}"
        )
    entries.keep_text(folder, texts)
    about = {
        **order.about, "name": order.name, "key": order.key, "flags": list(compilation.flags),
        "seconds": round(compilation.seconds, 4), "compiler": compiler.identity(),
        "compiler_version": toolchain.version(compiler, work),
        "created": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }  # fmt: skip
    return entries.write(folder, library, about)


def _moved(entry: Entry, place: Path) -> Entry:
    """Move a finished entry to its place by one rename; a damaged entry there is removed first."""
    for attempt in range(3):
        try:
            os.rename(entry.folder, place)
            return Entry(place, entry.about)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST, errno.ENOTDIR):
                raise
        # Another process without the lock was faster, or a damaged entry is there.
        with contextlib.suppress(Damaged):
            there = entries.read(place, str(entry.about["key"]))
            if there is not None:
                return there
        with contextlib.suppress(FileNotFoundError):
            os.rename(place, entry.folder.parent / f"replaced{attempt}")
    raise OSError(errno.EBUSY, "other processes write there repeatedly")


def _unwritable(place: Path, order: Order, error: OSError) -> str:
    if error.errno in _NO_ROOM:
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
        aside = Path(tempfile.mkdtemp(prefix=UNFINISHED, dir=place.parent))
        with contextlib.suppress(OSError):
            os.rename(place, aside / "removed")
        shutil.rmtree(aside, ignore_errors=True)
    except OSError:
        shutil.rmtree(place, ignore_errors=True)
    return size


def remove_leftovers(parent: Path, age: float = _FRESH) -> int:
    """Remove unfinished builds of killed processes; returns their number."""
    from ..host.lock import held_by_nobody

    count = 0
    for outer in parent.glob(f"{UNFINISHED}*"):
        with contextlib.suppress(OSError):
            if time.time() - outer.stat().st_mtime < age:
                continue
            with held_by_nobody(outer / LOCK) as abandoned:
                if abandoned:
                    shutil.rmtree(outer, ignore_errors=True)
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
