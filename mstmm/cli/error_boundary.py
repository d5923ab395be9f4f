"""Execution of a command with a message and an exit code instead of a traceback.

With MSTMM_DEBUG=1 in the environment the traceback is printed as well.  The exit codes:

    0    success                    3    missing software or permission
    1    internal error             4    numerical failure
    2    invalid input              130  interrupted
"""

from __future__ import annotations

import mmap
import os
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NoReturn

from mstmm import signal_handling
from mstmm.errors import EnvironmentFailure, Interrupted, MstmmError

from . import terminal_output

SUCCESS, INTERNAL_ERROR, INVALID_INPUT = 0, 1, MstmmError.exit_code
ENVIRONMENT, INTERRUPTED = EnvironmentFailure.exit_code, signal_handling.EXIT_CODE

#: Bytes that can be allocated unless the process is short of memory.
_SPARE_BYTES = 2**27


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
        code = _command_group()(args=list(arguments), prog_name="mstmm", standalone_mode=False)
        code = code if isinstance(code, int) else SUCCESS
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
def _command_group() -> Callable[..., Any]:
    """Group of all commands with their options, built once per process."""
    from typer.main import get_command

    from .app import app

    return get_command(app)


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


# --- messages -------------------------------------------------------------------------------------


def message_and_code(error: BaseException) -> tuple[str, int]:
    """Message and exit code for an exception."""
    import typer

    if isinstance(error, MstmmError):
        return str(error), error.exit_code
    if isinstance(error, typer.BadParameter.__mro__[2]):  # ClickException, whatever its module
        return _usage_message(error), INVALID_INPUT
    if isinstance(error, (KeyboardInterrupt, typer.Abort)):
        return "interrupted", INTERRUPTED
    if isinstance(error, MemoryError) or _is_short_of_memory():
        return "not enough memory; request fewer samples", ENVIRONMENT
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("mstmm"):
        return f"the package {error.name} is missing; install it: pip install {error.name}", 3
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename is not None else ""
        return f"{name}{error.strerror or error}", ENVIRONMENT
    position = _user_file_position(error)
    if position is not None:
        return f"{position}: {type(error).__name__}: {error}", INVALID_INPUT
    if isinstance(error, SystemExit):
        return f"an executed Python file calls exit ({error}); remove that call", INVALID_INPUT
    return (
        f"{type(error).__name__}: {error}\n"
        "This is a defect of mstmm, not of your input; please report it with your command.\n"
        "The same command with MSTMM_DEBUG=1 in the environment shows where it occurred.",
        INTERNAL_ERROR,
    )


def _is_short_of_memory() -> bool:
    """Whether the process is short of memory, where libraries fail with various exceptions."""
    try:
        mmap.mmap(-1, _SPARE_BYTES).close()
    except (OSError, MemoryError, ValueError):
        return True
    return False


def _user_file_position(error: BaseException) -> str | None:
    """File and line of a user's definition that raised the exception, or None."""
    position = None
    for frame, line in traceback.walk_tb(error.__traceback__):
        if str(frame.f_globals.get("__name__")).startswith("mstmm_user_"):
            position = f"{frame.f_code.co_filename}: line {line}"
    return position


def _usage_message(error: BaseException) -> str:
    """Message of typer about invalid arguments, followed by the help command."""
    describe = getattr(error, "format_message", None)
    message = str(describe() if callable(describe) else error)
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", None) or "mstmm"
    return f"{message}\nSee: {command} --help"
