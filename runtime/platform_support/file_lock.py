"""Lock between processes, by the operating system: it ends with its owner, even a killed one.

It saves work and never guards correctness: a build happens in a separate folder, which is renamed
when it is complete.  After a timeout, or on a file system without locks, the caller therefore
builds without the lock.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import json
import os
import time
from collections.abc import Iterator
from pathlib import Path

#: Pause between two attempts, s.
_RETRY_INTERVAL = 0.02

_LOCK_HELD_ERRORS = (errno.EAGAIN, errno.EACCES)


@contextlib.contextmanager
def file_lock(path: Path, timeout: float) -> Iterator[str]:
    """Hold the lock file `path` in a block; waits at most `timeout` s for its owner.

    Yields "", or the reason that the lock is not held.  The file names the process that holds it.
    """
    handle, remark = _acquire_lock(path, timeout)
    try:
        yield remark
    finally:
        if handle is not None:
            with contextlib.suppress(OSError):
                os.ftruncate(handle, 0)
            os.close(handle)


@contextlib.contextmanager
def lock_if_free(path: Path) -> Iterator[bool]:
    """Yield True, with the lock held, if no process holds it (or the file does not exist)."""
    try:
        handle = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    except FileNotFoundError:
        yield True
        return
    except OSError:
        yield False
        return
    try:
        yield _try_lock(handle) is True
    finally:
        os.close(handle)


def _acquire_lock(path: Path, timeout: float) -> tuple[int | None, str]:
    deadline = time.monotonic() + timeout
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        is_ours = _try_lock(handle)
        if is_ours and os.fstat(handle).st_nlink > 0:  # else: another process removed the file
            _write_owner(handle)
            return handle, ""
        owner = "" if is_ours else _read_owner(handle)
        os.close(handle)
        if is_ours is None:
            return None, "this file system has no locks"
        if time.monotonic() >= deadline:
            return None, f"{owner} held its lock for more than {timeout:g} s"
        if not is_ours:
            time.sleep(_RETRY_INTERVAL)


def _try_lock(handle: int) -> bool | None:
    """True if this process has the lock now, False if another has it, None without locks."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return False if error.errno in _LOCK_HELD_ERRORS else None
    return True


def _write_owner(handle: int) -> None:
    """Write the identity of this process for the message of waiting ones; ignore a full disk."""
    timestamp = time.strftime("%Y-%m-%d %H:%M:%S")
    text = json.dumps({"pid": os.getpid(), "host": os.uname().nodename, "since": timestamp})
    with contextlib.suppress(OSError):
        os.ftruncate(handle, 0)
        os.pwrite(handle, text.encode(), 0)


def _read_owner(handle: int) -> str:
    try:
        record = json.loads(os.pread(handle, 1000, 0))
        return f"process {record['pid']} on {record['host']} (since {record['since']})"
    except (OSError, ValueError, TypeError, KeyError):
        return "another process"
