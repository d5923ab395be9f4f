"""Execution of a command with a message and an exit code instead of a traceback.

With MSTMM_DEBUG=1 in the environment the traceback is printed as well.
"""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Sequence
from typing import NoReturn

from mstmm import interrupts
from mstmm.errors import Interrupted

from . import output
from .explain import DONE, INTERRUPTED, explain


def leave(arguments: Sequence[str]) -> NoReturn:
    """Run one command and end the process with its exit code."""
    output.prepare_streams()
    if not sys.warnoptions and not debugging():
        warnings.simplefilter("ignore")  # warnings of numpy are for developers, not for users
    from . import app  # noqa: F401 - loaded while an interrupt still ends the process at once

    interrupts.raise_in_the_command()
    try:
        code = run(arguments)
        output.settle_streams()
    finally:
        interrupts.end_at_once()
    interrupts.end_at_once(code, b"")
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command; every exception becomes a message on stderr and an exit code."""
    try:
        code = _command(list(arguments))
        if code == INTERRUPTED and interrupts.seen():  # typer took it for an exit
            raise KeyboardInterrupt
        output.flush()
        return code
    except BrokenPipeError:  # the reader closed the pipe (`| head`)
        output.discard()
        return DONE
    except BaseException as error:
        if isinstance(error, SystemExit) and isinstance(error.__context__, BrokenPipeError):
            output.discard()  # typer found the closed pipe first
            return DONE
        if interrupts.seen() and not isinstance(error, Interrupted):
            error = KeyboardInterrupt()  # interrupted code may raise any other exception
        message, code = explain(error)
        try:
            _report(error, message, code, "--json" in arguments)
        except OSError:  # the message cannot be written either
            output.discard()
        return code


def _command(arguments: list[str]) -> int:
    from .app import app

    code = app(args=arguments, prog_name="mstmm", standalone_mode=False)
    return code if isinstance(code, int) else DONE


def debugging() -> bool:
    """Whether MSTMM_DEBUG requests tracebacks."""
    return os.environ.get("MSTMM_DEBUG", "0") not in ("", "0")


def _report(error: BaseException, message: str, code: int, as_json: bool) -> None:
    if debugging():
        traceback.print_exception(error)
    output.complain(message)
    if as_json:
        problem = {"type": type(error).__name__, "message": message, "exit_code": code}
        output.emit_json({"error": problem})
        output.flush()
