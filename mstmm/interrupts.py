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

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FrameType
    from typing import NoReturn

    Handler = Callable[[int, FrameType | None], None]

#: Exit code of an interrupted command.
CODE = 130

_SIGNALS = (_signal.SIGINT, _signal.SIGTERM)

#: Seconds after which an interrupt comes again that met code which cannot raise.
_AGAIN = 0.01

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


def raise_in_the_command() -> None:
    """From now on an interrupt is a KeyboardInterrupt, and the second one ends the process."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _seen:
            _end(CODE, b"mstmm: interrupted\n")
        _seen.append(number)
        raise KeyboardInterrupt

    _handle(interrupt)
    sys.unraisablehook = _lost


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

    _signal.signal(_signal.SIGALRM, again)
    _signal.setitimer(_signal.ITIMER_REAL, _AGAIN)
