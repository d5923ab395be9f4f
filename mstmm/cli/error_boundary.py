"""Execution of a command with a message and an exit code instead of a traceback.

With MSTMM_DEBUG=1 in the environment the traceback is printed as well.
"""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from typing import NoReturn

from mstmm import signal_handling
from mstmm.errors import Interrupted

from . import terminal_output
from .error_messages import INTERRUPTED, SUCCESS, message_and_code


def run_and_exit(arguments: Sequence[str]) -> NoReturn:
    """Run one command and end the process with its exit code."""
    terminal_output.prepare_streams()
    if not sys.warnoptions and not is_debugging():
        warnings.simplefilter("ignore")  # warnings of numpy are for developers, not for users
    from . import app  # noqa: F401 - loaded while an interrupt still ends the process at once

    signal_handling.raise_on_signal()
    try:
        code = run(arguments)
        terminal_output.flush_streams()
    finally:
        signal_handling.exit_on_signal()
    signal_handling.exit_on_signal(code, b"")
    sys.exit(code)


def run(arguments: Sequence[str]) -> int:
    """Run one command; return its exit code, with exceptions as messages on stderr or JSON."""
    try:
        code = _run_command(list(arguments))
        if (
            code == INTERRUPTED and signal_handling.interrupt_received()
        ):  # typer took it for an exit
            raise KeyboardInterrupt
        terminal_output.flush()
        return code
    except BrokenPipeError:  # the reader closed the pipe (`| head`)
        terminal_output.discard_output()
        return SUCCESS
    except BaseException as error:
        if isinstance(error, SystemExit) and isinstance(error.__context__, BrokenPipeError):
            terminal_output.discard_output()  # typer found the closed pipe first
            return SUCCESS
        if signal_handling.interrupt_received() and not isinstance(error, Interrupted):
            error = KeyboardInterrupt()  # interrupted code may raise any other exception
        message, code = message_and_code(error)
        try:
            _report_error(error, message, code, "--json" in arguments)
        except OSError:  # the message cannot be written either
            terminal_output.discard_output()
        return code


@cache
def _command_group() -> Callable[..., object]:
    """Group of all commands with their options, built once per process."""
    from typer.main import get_command

    from .app import app

    return get_command(app)


def _run_command(arguments: list[str]) -> int:
    code = _command_group()(args=arguments, prog_name="mstmm", standalone_mode=False)
    return code if isinstance(code, int) else SUCCESS


def is_debugging() -> bool:
    """Whether MSTMM_DEBUG requests tracebacks."""
    return os.environ.get("MSTMM_DEBUG", "0") not in ("", "0")


def _report_error(error: BaseException, message: str, code: int, as_json: bool) -> None:
    if is_debugging():
        traceback.print_exception(error)
    terminal_output.print_error(message)
    if as_json:
        problem = {"type": type(error).__name__, "message": message, "exit_code": code}
        terminal_output.print_json({"error": problem})
        terminal_output.flush()
