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
CODE = 130

_SIGNALS = (_signal.SIGINT, _signal.SIGTERM)

#: Seconds until an interrupt is repeated that arrived in code which cannot raise, and seconds that
#: an import has to finish.
_AGAIN, _IMPORT = 0.001, 1.0

_seen: list[int] = []


def is_the_program() -> bool:
    """Whether the process is `mstmm ...` or `python -m mstmm ...`, so that signals are ours."""
    name = os.path.basename(sys.argv[0]) if sys.argv else ""
    words = sys.orig_argv
    as_module = name == "-m" and "mstmm" in words[words.index("-m") + 1 :][:1]
    return name in ("mstmm", "mstmm.exe") or as_module


def seen() -> bool:
    """Whether an interrupt has been raised in this process."""
    return bool(_seen)


def end_at_once(code: int = CODE, word: bytes = b"mstmm: interrupted\n") -> None:
    """Let an interrupt end the process with this code and a message on standard error."""

    def end(number: int, frame: FrameType | None) -> None:
        _end(code, word)

    _handle(end)
    if _seen and _signal.setitimer(_signal.ITIMER_REAL, 0.0)[0]:  # a repetition was pending
        _end(CODE, b"mstmm: interrupted\n")


def raise_in_the_command() -> None:
    """Let an interrupt raise KeyboardInterrupt, and a second one end the process.

    An import is not interrupted unless it takes long: libraries written in other languages may
    print their own messages about the exception.
    """

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _seen:
            _end(CODE, b"mstmm: interrupted\n")
        _seen.append(number)
        raise_when_loaded(time.monotonic() + _IMPORT, frame)

    def raise_when_loaded(latest: float, frame: FrameType | None) -> None:
        if time.monotonic() < latest and _importing(frame):
            _call_again(lambda _, later: raise_when_loaded(latest, later))
        else:
            raise KeyboardInterrupt

    _handle(interrupt)
    sys.unraisablehook = _lost


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _handle(handler: Handler) -> None:
    for number in _SIGNALS:
        if _signal.getsignal(number) is not _signal.SIG_IGN:
            _signal.signal(number, handler)


def _end(code: int, word: bytes) -> NoReturn:
    try:
        os.write(2, word)
    except OSError:  # standard error is closed
        pass
    finally:
        os._exit(code)


def _lost(unraisable: sys.UnraisableHookArgs) -> None:
    """Repeat an interrupt raised in a finalizer or C callback, where Python only prints it."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
        return

    def again(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    _call_again(again)


def _call_again(handler: Handler) -> None:
    _signal.signal(_signal.SIGALRM, handler)
    _signal.setitimer(_signal.ITIMER_REAL, _AGAIN)
