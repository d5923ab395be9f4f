"""Conversion of an exception to the user's message and the exit code of the program.

The codes:

    0    success                    3    missing software or permission
    1    internal error             4    numerical failure
    2    invalid input              130  interrupted
"""

from __future__ import annotations

import mmap
import traceback

from mstmm import signal_handling
from mstmm.errors import EnvironmentFailure, MstmmError

SUCCESS, INTERNAL_ERROR, INVALID_INPUT = 0, 1, MstmmError.exit_code
ENVIRONMENT, INTERRUPTED = EnvironmentFailure.exit_code, signal_handling.EXIT_CODE

#: Bytes that can be allocated unless the process is short of memory.
_SPARE_BYTES = 2**27


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
