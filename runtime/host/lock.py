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
_PAUSE = 0.02

_HELD = (errno.EAGAIN, errno.EACCES)


@contextlib.contextmanager
def locked(path: Path, timeout: float) -> Iterator[str]:
    """Hold the lock file `path` in a block; waits at most `timeout` s for its owner.

    Yields "", or the reason that the lock is not held.  The file names the process that holds it.
    """
    handle, remark = _acquired(path, timeout)
    try:
        yield remark
    finally:
        if handle is not None:
            with contextlib.suppress(OSError):
                os.ftruncate(handle, 0)
            os.close(handle)


@contextlib.contextmanager
def held_by_nobody(path: Path) -> Iterator[bool]:
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
        yield _try(handle) is True
    finally:
        os.close(handle)


def _acquired(path: Path, timeout: float) -> tuple[int | None, str]:
    deadline = time.monotonic() + timeout
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        got = _try(handle)
        if got and os.fstat(handle).st_nlink > 0:  # else: another process removed the file
            _sign(handle)
            return handle, ""
        owner = "" if got else _owner(handle)
        os.close(handle)
        if got is None:
            return None, "this file system has no locks"
        if time.monotonic() >= deadline:
            return None, f"{owner} held its lock for more than {timeout:g} s"
        if not got:
            time.sleep(_PAUSE)


def _try(handle: int) -> bool | None:
    """True if this process has the lock now, False if another has it, None without locks."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        return False if error.errno in _HELD else None
    return True


def _sign(handle: int) -> None:
    """Write the identity of this process for the message of waiting ones; ignore a full disk."""
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    text = json.dumps({"pid": os.getpid(), "host": os.uname().nodename, "since": since})
    with contextlib.suppress(OSError):
        os.ftruncate(handle, 0)
        os.pwrite(handle, text.encode(), 0)


def _owner(handle: int) -> str:
    try:
        said = json.loads(os.pread(handle, 1000, 0))
        return f"process {said['pid']} on {said['host']} (since {said['since']})"
    except (OSError, ValueError, TypeError, KeyError):
        return "another process"
