"""Handling of Ctrl-C and SIGTERM in the program `mstmm`, without a traceback at any time.

Until the command begins there is nothing to clean up: an interrupt ends the process at once, with a
message.  Later it is a KeyboardInterrupt, so that compilers are stopped and files closed; a second
interrupt ends the process at once.  A signal that the process inherits as ignored (nohup,
background job of a script) stays ignored.

The program loads this module first, so it imports only built-in modules.
"""

from __future__ import annotations

import _signal
import os
import sys
import time

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import NoReturn

    Handler = Callable[[int, FrameType | None], None]

#: Exit code of an interrupted command.
EXIT_CODE = 130

_SIGNALS = (_signal.SIGINT, _signal.SIGTERM)

#: Seconds until an interrupt is repeated that arrived in code which cannot raise, and seconds that
#: an import has to finish.
_REPEAT_DELAY, _MAX_IMPORT_WAIT = 0.001, 1.0

_raised_signals: list[int] = []


def is_cli_process() -> bool:
    """Whether the process is `mstmm ...` or `python -m mstmm ...`, so that signals are ours."""
    name = os.path.basename(sys.argv[0]) if sys.argv else ""
    arguments = sys.orig_argv
    is_module_run = name == "-m" and "mstmm" in arguments[arguments.index("-m") + 1 :][:1]
    return name in ("mstmm", "mstmm.exe") or is_module_run


def interrupt_received() -> bool:
    """Whether an interrupt has been raised in this process."""
    return bool(_raised_signals)


def exit_on_signal(code: int = EXIT_CODE, word: bytes = b"mstmm: interrupted\n") -> None:
    """Let an interrupt end the process with this code and a message on standard error."""

    def exit_process(number: int, frame: FrameType | None) -> None:
        _exit(code, word)

    _set_handler(exit_process)
    if (
        _raised_signals and _signal.setitimer(_signal.ITIMER_REAL, 0.0)[0]
    ):  # a repetition was pending
        _exit(EXIT_CODE, b"mstmm: interrupted\n")


def raise_on_signal() -> None:
    """Let an interrupt raise KeyboardInterrupt, and a second one end the process.

    An import is not interrupted unless it takes long: libraries written in other languages may
    print their own messages about the exception.
    """

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _raised_signals:
            _exit(EXIT_CODE, b"mstmm: interrupted\n")
        _raised_signals.append(number)
        raise_when_loaded(time.monotonic() + _MAX_IMPORT_WAIT, frame)

    def raise_when_loaded(latest: float, frame: FrameType | None) -> None:
        if time.monotonic() < latest and _is_importing(frame):
            _schedule_repeat(lambda _, later: raise_when_loaded(latest, later))
        else:
            raise KeyboardInterrupt

    _set_handler(interrupt)
    sys.unraisablehook = _handle_unraisable


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _set_handler(handler: Handler) -> None:
    for number in _SIGNALS:
        if _signal.getsignal(number) is not _signal.SIG_IGN:
            _signal.signal(number, handler)


def _exit(code: int, word: bytes) -> NoReturn:
    try:
        os.write(2, word)
    except OSError:  # standard error is closed
        pass
    finally:
        os._exit(code)


def _handle_unraisable(unraisable: sys.UnraisableHookArgs) -> None:
    """Repeat an interrupt raised in a finalizer or C callback, where Python only prints it."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
        return

    def repeat_interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    _schedule_repeat(repeat_interrupt)


def _schedule_repeat(handler: Handler) -> None:
    _signal.signal(_signal.SIGALRM, handler)
    _signal.setitimer(_signal.ITIMER_REAL, _REPEAT_DELAY)
