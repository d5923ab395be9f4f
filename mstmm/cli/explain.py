"""From an exception to the message that a user sees and the exit code of the program.

The codes:

    0    done                       3    something this machine lacks
    1    a defect of mstmm          4    numerical failure
    2    bad input                  130  interrupted
"""

from __future__ import annotations

import mmap
import traceback

from mstmm import interrupts
from mstmm.errors import EnvironmentFailure, MstmmError

DONE, DEFECT, BAD_INPUT = 0, 1, MstmmError.exit_code
ENVIRONMENT, INTERRUPTED = EnvironmentFailure.exit_code, interrupts.CODE

#: Bytes that a process can always get where it is not short of memory.
_SPARE = 2**27


def explain(error: BaseException) -> tuple[str, int]:
    """The message a user sees for an exception, and the exit code."""
    import typer

    if isinstance(error, MstmmError):
        return str(error), error.exit_code
    if isinstance(error, typer.BadParameter.__mro__[2]):  # ClickException, wherever typer keeps it
        return _usage(error), BAD_INPUT
    if isinstance(error, (KeyboardInterrupt, typer.Abort)):
        return "interrupted", INTERRUPTED
    if isinstance(error, MemoryError) or _is_short_of_memory():
        return "there is not enough memory for this; ask for fewer samples", ENVIRONMENT
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("mstmm"):
        return f"the package {error.name} is missing; install it: pip install {error.name}", 3
    if isinstance(error, OSError):
        name = f"{error.filename}: " if error.filename is not None else ""
        return f"{name}{error.strerror or error}", ENVIRONMENT
    place = _in_a_users_file(error)
    if place is not None:
        return f"{place}: {type(error).__name__}: {error}", BAD_INPUT
    if isinstance(error, SystemExit):
        return f"a file that was run asked to stop ({error}); take the exit out of it", BAD_INPUT
    return (
        f"{type(error).__name__}: {error}\n"
        "This is a defect of mstmm, not of your input; please report it with your command.\n"
        "The same command with MSTMM_DEBUG=1 in the environment shows where it happened.",
        DEFECT,
    )


def _is_short_of_memory() -> bool:
    """Whether the process can hardly get memory, of which its libraries fail in many ways."""
    try:
        mmap.mmap(-1, _SPARE).close()
    except (OSError, MemoryError, ValueError):
        return True
    return False


def _in_a_users_file(error: BaseException) -> str | None:
    """File and line of a definition of the user's from which the exception came."""
    place = None
    for frame, line in traceback.walk_tb(error.__traceback__):
        if str(frame.f_globals.get("__name__")).startswith("mstmm_user_"):
            place = f"{frame.f_code.co_filename}: line {line}"
    return place


def _usage(error: BaseException) -> str:
    """What typer found wrong with the arguments, on one line, and where to look."""
    describe = getattr(error, "format_message", None)
    message = str(describe() if callable(describe) else error)
    context = getattr(error, "ctx", None)
    command = getattr(context, "command_path", None) or "mstmm"
    return f"{message}\nSee: {command} --help"
