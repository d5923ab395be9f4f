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

from .file_lock import file_lock, lock_if_free


def require_path(given: Any) -> Path:
    """Convert a name or a path-like object to a path; SceneError for anything else."""
    try:
        return Path(given)
    except TypeError:
        raise SceneError(f'file {given!r}: expected a path, such as "out.csv"') from None


def require_regular_file(path: Path, where: str) -> None:
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
_SEAL_LENGTH = len(_SEAL) + 64


def seal(path: Path) -> None:
    """Append a file's hash to the file; readers of formats with a stored length ignore it."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    with path.open("ab") as file:
        file.write(_SEAL + digest.encode())


def seal_is_broken(path: Path) -> bool:
    """True if the seal at the end of a file contradicts its content; False without a seal.

    Libraries that read binary formats may crash or hang on damaged files, where no exception helps.
    """
    size = path.stat().st_size - _SEAL_LENGTH
    if size < 0:
        return False
    digest = hashlib.sha256()
    with path.open("rb") as file:
        file.seek(size)
        stored_seal = file.read()
        if not stored_seal.startswith(_SEAL):
            return False
        file.seek(0)
        while size > 0 and (chunk := file.read(min(size, _CHUNK_BYTES))):
            digest.update(chunk)
            size -= len(chunk)
    return stored_seal[len(_SEAL) :] != digest.hexdigest().encode()


#: Bytes read at a time.
_CHUNK_BYTES = 2**20

#: An unfinished file, PART, is in the folder of its target, with a LOCK that ends with the writer.
_PREFIX, _LOCK_SUFFIX, _PART_SUFFIX = ".mstmm-", ".lock", ".part"

#: Time limit for a lock, s; a process that removes old files holds one for less.
_LOCK_TIMEOUT = 5.0


@contextlib.contextmanager
def replace_atomically(path: Path) -> Iterator[Path]:
    """Yield a temporary file that replaces `path` when the block ends without an exception.

    It is in the same folder and is synchronised to the disk before it replaces the old file.
    Leftovers of killed writers in that folder are removed first.
    Raises EnvironmentFailure, with the old file untouched, if anything cannot be written.
    """
    try:
        remove_abandoned_files(path.parent)
        with _temporary_file(path.parent) as temporary:
            yield temporary
            _sync_to_disk(temporary)
            temporary.replace(path)
            with contextlib.suppress(OSError):  # not every file system lets folders be synced
                _sync_to_disk(path.parent)
    except OSError as error:
        reason = error.strerror or str(error)
        raise EnvironmentFailure(f'"{path}" cannot be written: {reason}') from error


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically: the old one stays complete until the new one is on the disk.

    A link of this name is replaced, not followed.  EnvironmentFailure if it cannot be written.
    """
    with replace_atomically(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


@contextlib.contextmanager
def _temporary_file(folder: Path) -> Iterator[Path]:
    """Yield the name of a temporary file; its lock is made before the file and removed after it."""
    lock = folder / f"{_PREFIX}{secrets.token_hex(8)}{_LOCK_SUFFIX}"
    part = lock.with_suffix(_PART_SUFFIX)
    try:
        with file_lock(lock, _LOCK_TIMEOUT):
            try:
                yield part
            finally:
                part.unlink(missing_ok=True)
    finally:
        lock.unlink(missing_ok=True)


def remove_abandoned_files(folder: Path) -> None:
    """Remove the temporary files of killed writers from a folder.  Never raises OSError."""
    with contextlib.suppress(OSError):
        for lock in [*folder.glob(f"{_PREFIX}*{_LOCK_SUFFIX}")]:
            with contextlib.suppress(OSError), lock_if_free(lock) as is_abandoned:
                if is_abandoned:
                    lock.with_suffix(_PART_SUFFIX).unlink(missing_ok=True)
                    lock.unlink(missing_ok=True)


def _sync_to_disk(path: Path) -> None:
    """Wait until a file or a folder is on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
