"""Reading files that are files, and writing them so that a reader never sees half of one."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure, SceneError

from .lock import held_by_nobody, locked


def path_of(given: Any) -> Path:
    """The path that a name or a path-like object is; SceneError for anything else."""
    try:
        return Path(given)
    except TypeError:
        raise SceneError(f'file {given!r}: expected a path, such as "out.csv"') from None


def refuse_special(path: Path, where: str) -> None:
    """SceneError for a folder, a device or a named pipe, which a reader would wait on for ever.

    A file that is missing is left to whoever opens it.
    """
    if os.path.exists(path) and not os.path.isfile(path):  # False where a folder is closed to us
        raise SceneError(f"{where}: {path} is not a regular file; give the path of one")


def read_arrays(path: Path) -> dict[str, Any]:
    """All arrays of an .npz file by name.

    Raises FileNotFoundError, and ValueError with a reason for what is no such file or damaged.
    """
    import numpy as np

    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise
    except Exception as error:  # of a dozen kinds, for bytes that nobody wrote
        raise ValueError(str(error) or type(error).__name__) from error


#: How the seal of a file begins; the hash of all before it follows.
_SEAL = b"\nmstmm sha256 "
_SEALED = len(_SEAL) + 64


def seal(path: Path) -> None:
    """Append the hash of a file to it.  Readers of formats that know where they end ignore it."""
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    with path.open("ab") as file:
        file.write(_SEAL + found.encode())


def seal_is_broken(path: Path) -> bool:
    """True if a file ends with a seal and is not what was sealed; False also without a seal.

    Libraries that read binary formats may crash or hang on damaged files, and cannot be caught.
    """
    size = path.stat().st_size - _SEALED
    if size < 0:
        return False
    found = hashlib.sha256()
    with path.open("rb") as file:
        file.seek(size)
        end = file.read()
        if not end.startswith(_SEAL):
            return False
        file.seek(0)
        while size > 0 and (part := file.read(min(size, _PART_OF_FILE))):
            found.update(part)
            size -= len(part)
    return end[len(_SEAL) :] != found.hexdigest().encode()


#: Bytes read at a time.
_PART_OF_FILE = 2**20

#: What is being written lies beside its place, PART, with a LOCK that ends with the writer.
_MARK, _LOCK, _PART = ".mstmm-", ".lock", ".part"

#: A sweeper holds a lock for less than this, s.
_PATIENCE = 5.0


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path` that takes its name, safely on the disk, when the block ends
    well.  What killed writers left in that folder is swept first.

    Raises EnvironmentFailure, with the old file untouched, if anything cannot be written.
    """
    try:
        sweep(path.parent)
        with _aside(path.parent) as temporary:
            yield temporary
            _settle(temporary)
            temporary.replace(path)
            with contextlib.suppress(OSError):  # not every file system lets folders be synced
                _settle(path.parent)
    except OSError as error:
        reason = error.strerror or str(error)
        raise EnvironmentFailure(f'"{path}" cannot be written: {reason}') from error


def write_text(path: Path, text: str) -> None:
    """Write a text file so that the old one stays whole until the new one is on the disk; a link of
    this name is replaced, not followed.  EnvironmentFailure where it cannot be written."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def _aside(folder: Path) -> Iterator[Path]:
    """Name of a file to be written; the lock is made before that file and removed after it."""
    lock = folder / f"{_MARK}{secrets.token_hex(8)}{_LOCK}"
    part = lock.with_suffix(_PART)
    try:
        with locked(lock, _PATIENCE):
            try:
                yield part
            finally:
                part.unlink(missing_ok=True)
    finally:
        lock.unlink(missing_ok=True)


def sweep(folder: Path) -> None:
    """Remove what killed writers left in a folder.  Never raises OSError."""
    with contextlib.suppress(OSError):
        for lock in [*folder.glob(f"{_MARK}*{_LOCK}")]:
            with contextlib.suppress(OSError), held_by_nobody(lock) as abandoned:
                if abandoned:
                    lock.with_suffix(_PART).unlink(missing_ok=True)
                    lock.unlink(missing_ok=True)


def _settle(path: Path) -> None:
    """Wait until a file or a folder is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
