"""Handle Ctrl-C and SIGTERM in code that must not be interrupted at an arbitrary point."""

from __future__ import annotations

import signal
import threading
import time
from typing import Any

#: Signals upon which a run ends with the samples that it has.
INTERRUPTS = (signal.SIGINT, signal.SIGTERM)

#: Seconds within which an interrupted run must end.
MAX_INTERRUPT_DELAY = 5.0


class Interrupt:
    """Flag that becomes true when a signal arrives; testing it acknowledges the signal."""

    def __init__(self) -> None:
        self.heard, self._came = False, False

    def record(self) -> None:
        """Record that a signal has arrived."""
        self._came = True

    def __bool__(self) -> bool:
        self.heard = self.heard or self._came
        return self._came


#: Flags of the blocks that the main thread is in, outermost first.
_open_flags: list[Interrupt] = []


class record_interrupts:
    """Context that records Ctrl-C and SIGTERM in a flag instead of ending the program.

    A signal sets the flags of all nested blocks, so that an inner block that ends for another
    reason does not hide it from the outer one.  If no flag has been tested by the end of the
    outermost block, the signal is raised again: a program of many short runs ends by it, too.
    A signal that this process ignores (nohup, a script's background job) stays ignored.
    If no flag is tested for PATIENCE, the next signal raises KeyboardInterrupt.
    """

    def __enter__(self) -> Interrupt:
        self._flag, self._came, self._since = Interrupt(), 0, 0.0
        self._before: list[tuple[signal.Signals, Any]] = []
        self._here = threading.get_ident() == threading.main_thread().ident
        if self._here:
            if not _open_flags:  # else the handler of the outermost block sets all flags
                self._handle()
            _open_flags.append(self._flag)
        return self._flag

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if not self._here:
            return
        _open_flags.pop()  # before a signal can be an exception again
        if _open_flags:
            _open_flags[0].heard = _open_flags[0].heard or self._flag.heard
            return
        self._restore()
        is_handled = kind is not None and issubclass(kind, KeyboardInterrupt)
        if self._came and not (self._flag.heard or is_handled):
            signal.raise_signal(self._came)

    def _handle(self) -> None:
        try:
            for signal_number in INTERRUPTS:
                previous_handler = signal.getsignal(signal_number)
                if previous_handler is not None and previous_handler is not signal.SIG_IGN:
                    self._before.append((signal_number, previous_handler))
                    signal.signal(signal_number, self._note)
        except BaseException:  # a signal that arrived between two of these lines
            self._restore()
            raise

    def _restore(self) -> None:
        for signal_number, previous_handler in reversed(self._before):
            signal.signal(signal_number, previous_handler)

    def _note(self, which: int, _: object) -> None:
        self._came = which
        for flag in (self._flag, *_open_flags):
            flag.record()
        if not self._since:
            self._since = time.monotonic()
        elif time.monotonic() - self._since > MAX_INTERRUPT_DELAY:
            raise KeyboardInterrupt
