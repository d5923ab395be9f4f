"""Ctrl-C and SIGTERM while something runs that must not be cut off just anywhere."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

#: Signals that ask a run to end with what it has.
INTERRUPTS = (signal.SIGINT, signal.SIGTERM)

#: Seconds in which an interrupted run has to come to an end.
PATIENCE = 5.0


#: Flags of the blocks that the main thread is in.
_open: list[list[bool]] = []


@contextmanager
def interruptible() -> Iterator[list[bool]]:
    """Ctrl-C and SIGTERM set the flag instead of ending anything, so that no sample is lost.

    Within another such block the flags of both are set: what ends for another reason while a signal
    comes does not hide it from who has more to do.  A signal that this process was told to ignore
    (nohup, a script's background job) stays ignored.
    Where nobody has looked at the flag for PATIENCE, the next signal is a KeyboardInterrupt.
    """
    flag, since = [False], [0.0]
    if threading.current_thread() is not threading.main_thread():
        yield flag
        return
    if _open:  # its handler sets all flags
        _open.append(flag)
        try:
            yield flag
        finally:
            _open.pop()
        return

    def note(*_: object) -> None:
        for outer in _open:
            outer[0] = True
        if not since[0]:
            since[0] = time.monotonic()
        elif time.monotonic() - since[0] > PATIENCE:
            raise KeyboardInterrupt

    before: list[tuple[signal.Signals, Any]] = []
    _open.append(flag)
    try:
        for which in INTERRUPTS:
            previous = signal.getsignal(which)
            if previous is not None and previous is not signal.SIG_IGN:
                before.append((which, previous))
                signal.signal(which, note)
        yield flag
    finally:
        for which, previous in reversed(before):
            signal.signal(which, previous)
        _open.pop()
