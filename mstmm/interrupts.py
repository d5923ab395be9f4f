"""Ctrl-C and SIGTERM for the program `mstmm`: never a traceback, from its first line to its last.

Until the command begins there is nothing to tidy up: an interrupt ends the process at once, with a
word.  Then it is a KeyboardInterrupt, so that compilers are stopped and files closed; a second one
ends the process at once.  A signal that the process was told to ignore (nohup, a script's
background job) stays ignored.

This is the first module that the program loads, so it loads nothing itself but built-in ones.
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

#: Seconds after which an interrupt comes again that met code which cannot raise, and those that an
#: import has to come to its end.
_AGAIN, _IMPORT = 0.001, 1.0

_seen: list[int] = []


def is_the_program() -> bool:
    """True in `mstmm ...` and `python -m mstmm ...`, where nothing but this may handle signals."""
    name = os.path.basename(sys.argv[0]) if sys.argv else ""
    words = sys.orig_argv
    as_module = name == "-m" and "mstmm" in words[words.index("-m") + 1 :][:1]
    return name in ("mstmm", "mstmm.exe") or as_module


def seen() -> bool:
    """True if an interrupt has been raised in this process."""
    return bool(_seen)


def end_at_once(code: int = CODE, word: bytes = b"mstmm: interrupted\n") -> None:
    """From now on an interrupt ends the process with this code, with a word on standard error."""

    def end(number: int, frame: FrameType | None) -> None:
        _end(code, word)

    _handle(end)
    if _seen and _signal.setitimer(_signal.ITIMER_REAL, 0.0)[0]:  # one was to come again
        _end(CODE, b"mstmm: interrupted\n")


def raise_in_the_command() -> None:
    """From now on an interrupt is a KeyboardInterrupt, and the second one ends the process.

    An import is not cut off in its middle, unless it takes long: what it loads may tell of the
    exception in its own words, as libraries written in other languages do.
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
    except OSError:  # nobody listens
        pass
    finally:
        os._exit(code)


def _lost(unraisable: sys.UnraisableHookArgs) -> None:
    """An interrupt inside a finalizer or a callback of C, which Python would print and forget."""
    if not issubclass(unraisable.exc_type, KeyboardInterrupt):
        sys.__unraisablehook__(unraisable)
        return

    def again(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    _call_again(again)


def _call_again(handler: Handler) -> None:
    _signal.signal(_signal.SIGALRM, handler)
    _signal.setitimer(_signal.ITIMER_REAL, _AGAIN)
