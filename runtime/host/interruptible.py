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


class Interrupt:
    """Whether a signal has come since a block began: true from then on, and who asks has heard."""

    def __init__(self) -> None:
        self.heard, self._came = False, False

    def come(self) -> None:
        """A signal is here."""
        self._came = True

    def __bool__(self) -> bool:
        self.heard = self.heard or self._came
        return self._came


#: What the blocks that the main thread is in are told by.
_open: list[Interrupt] = []


@contextmanager
def interruptible() -> Iterator[Interrupt]:
    """Ctrl-C and SIGTERM are told instead of ending anything, so that no sample is lost.

    Within another such block both are told: what ends for another reason while a signal comes does
    not hide it from who has more to do.  Where nobody has heard of it by the end of the outermost
    one, the signal comes again then: a program of many short runs ends by it, too.  A signal that
    this process was told to ignore (nohup, a script's background job) stays ignored.
    Where nobody has asked for PATIENCE, the next signal is a KeyboardInterrupt.
    """
    told = Interrupt()
    if threading.current_thread() is not threading.main_thread():
        yield told
        return
    if _open:  # its handler tells all
        _open.append(told)
        try:
            yield told
        finally:
            _open.pop()
            _open[0].heard = _open[0].heard or told.heard
        return
    with _handled(told) as came:
        yield told
    if came and not told.heard:
        signal.raise_signal(came[0])


@contextmanager
def _handled(told: Interrupt) -> Iterator[list[int]]:
    """The outermost block: which signals have come."""
    came, since = list[int](), [0.0]

    def note(which: int, _: object) -> None:
        came.append(which)
        for one in _open:
            one.come()
        if not since[0]:
            since[0] = time.monotonic()
        elif time.monotonic() - since[0] > PATIENCE:
            raise KeyboardInterrupt

    before: list[tuple[signal.Signals, Any]] = []
    _open.append(told)
    try:
        for which in INTERRUPTS:
            previous = signal.getsignal(which)
            if previous is not None and previous is not signal.SIG_IGN:
                before.append((which, previous))
                signal.signal(which, note)
        yield came
    finally:
        for which, previous in reversed(before):
            signal.signal(which, previous)
        _open.pop()
