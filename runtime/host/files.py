"""Read regular files, and write files atomically so that no reader sees an incomplete one."""

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
    """Convert a name or a path-like object to a path; SceneError for anything else."""
    try:
        return Path(given)
    except TypeError:
        raise SceneError(f'file {given!r}: expected a path, such as "out.csv"') from None


def refuse_special(path: Path, where: str) -> None:
    """Raise SceneError for a folder, a device or a named pipe, which could block a reader forever.

    A missing file passes: opening it raises its own error.
    """
    if os.path.exists(path) and not os.path.isfile(path):  # exists: False without access rights
        raise SceneError(f"{where}: {path} is not a regular file; give the path of one")


def read_arrays(path: Path) -> dict[str, Any]:
    """All arrays of an .npz file by name.

    Raises FileNotFoundError, and ValueError with a reason if the file is damaged or no .npz file.
    """
    import numpy as np

    try:
        with path.open("rb") as raw, np.load(raw, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise
    except Exception as error:  # damaged bytes cause a dozen kinds of exceptions
        raise ValueError(str(error) or type(error).__name__) from error


#: Prefix of a file's seal; the hash of all bytes before the seal follows.
_SEAL = b"\nmstmm sha256 "
_SEALED = len(_SEAL) + 64


def seal(path: Path) -> None:
    """Append a file's hash to the file; readers of formats with a stored length ignore it."""
    with path.open("rb") as file:
        found = hashlib.file_digest(file, "sha256").hexdigest()
    with path.open("ab") as file:
        file.write(_SEAL + found.encode())


def seal_is_broken(path: Path) -> bool:
    """True if the seal at the end of a file contradicts its content; False without a seal.

    Libraries that read binary formats may crash or hang on damaged files, where no exception helps.
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

#: An unfinished file, PART, is in the folder of its target, with a LOCK that ends with the writer.
_MARK, _LOCK, _PART = ".mstmm-", ".lock", ".part"

#: Time limit for a lock, s; a process that removes old files holds one for less.
_PATIENCE = 5.0


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file that replaces `path` when the block ends without an exception.

    It is in the same folder and is synchronised to the disk before it replaces the old file.
    Leftovers of killed writers in that folder are removed first.
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
    """Write a text file atomically: the old one stays complete until the new one is on the disk.

    A link of this name is replaced, not followed.  EnvironmentFailure if it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def _aside(folder: Path) -> Iterator[Path]:
    """Yield the name of a temporary file; its lock is made before the file and removed after it."""
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
    """Remove the temporary files of killed writers from a folder.  Never raises OSError."""
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
