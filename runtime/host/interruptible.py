"""Ctrl-C and SIGTERM while something runs that must not be cut off just anywhere."""

from __future__ import annotations

import signal
import threading
import time
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


class interruptible:
    """Ctrl-C and SIGTERM are told instead of ending anything, so that no sample is lost.

    Within another such block both are told: what ends for another reason while a signal comes does
    not hide it from who has more to do.  Where nobody has heard of it by the end of the outermost
    one, the signal comes again then: a program of many short runs ends by it, too.  A signal that
    this process was told to ignore (nohup, a script's background job) stays ignored.
    Where nobody has asked for PATIENCE, the next signal is a KeyboardInterrupt.
    """

    def __enter__(self) -> Interrupt:
        self._told, self._came, self._since = Interrupt(), 0, 0.0
        self._before: list[tuple[signal.Signals, Any]] = []
        self._here = threading.get_ident() == threading.main_thread().ident
        if self._here:
            if not _open:  # else the outermost one's handler tells all
                self._handle()
            _open.append(self._told)
        return self._told

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if not self._here:
            return
        _open.pop()  # before a signal can be an exception again
        if _open:
            _open[0].heard = _open[0].heard or self._told.heard
            return
        self._restore()
        answered = kind is not None and issubclass(kind, KeyboardInterrupt)
        if self._came and not (self._told.heard or answered):
            signal.raise_signal(self._came)

    def _handle(self) -> None:
        try:
            for which in INTERRUPTS:
                previous = signal.getsignal(which)
                if previous is not None and previous is not signal.SIG_IGN:
                    self._before.append((which, previous))
                    signal.signal(which, self._note)
        except BaseException:  # a signal that came between
            self._restore()
            raise

    def _restore(self) -> None:
        for which, previous in reversed(self._before):
            signal.signal(which, previous)

    def _note(self, which: int, _: object) -> None:
        self._came = which
        for one in (self._told, *_open):
            one.come()
        if not self._since:
            self._since = time.monotonic()
        elif time.monotonic() - self._since > PATIENCE:
            raise KeyboardInterrupt
