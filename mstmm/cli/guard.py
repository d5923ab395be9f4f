"""From an exception to one message and an exit code: no user ever meets a traceback.

    0    done                       3    something this machine lacks
    1    a defect of mstmm          4    numerical failure
    2    bad input                  130  interrupted

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
from mstmm.errors import Interrupted, MstmmError

from . import output

DONE, DEFECT, BAD_INPUT, ENVIRONMENT, INTERRUPTED = 0, 1, 2, 3, interrupts.CODE


def leave(arguments: Sequence[str]) -> NoReturn:
    """The program: run one command and end the process with its exit code."""
    output.prepare_streams()
    if not sys.warnoptions and not debugging():
        warnings.simplefilter("ignore")  # numpy's warnings go to developers, not to users
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
    except BrokenPipeError:  # the reader of our output has seen enough (`| head`)
        output.discard()
        return DONE
    except BaseException as error:
        if isinstance(error, SystemExit) and isinstance(error.__context__, BrokenPipeError):
            output.discard()  # typer met the closed pipe first
            return DONE
        if interrupts.seen() and not isinstance(error, Interrupted):
            error = KeyboardInterrupt()  # whatever became of it in the code that it met
        try:
            return _report(error, "--json" in arguments)
        except OSError:  # not even the message could be written
            output.discard()
            return ENVIRONMENT


def _command(arguments: list[str]) -> int:
    from .app import app

    code = app(args=arguments, prog_name="mstmm", standalone_mode=False)
    return code if isinstance(code, int) else DONE


def debugging() -> bool:
    """True if MSTMM_DEBUG asks for tracebacks."""
    return os.environ.get("MSTMM_DEBUG", "0") not in ("", "0")


def _report(error: BaseException, as_json: bool) -> int:
    if debugging():
        traceback.print_exception(error)
    message, code = explain(error)
    output.complain(message)
    if as_json:
        problem = {"type": type(error).__name__, "message": message, "exit_code": code}
        output.emit_json({"error": problem})
        output.flush()
    return code


def explain(error: BaseException) -> tuple[str, int]:
    """The message a user sees for an exception, and the exit code."""
    import typer

    if isinstance(error, MstmmError):
        return str(error), error.exit_code
    if isinstance(error, typer.BadParameter.__mro__[2]):  # ClickException, wherever typer keeps it
        return _usage(error), BAD_INPUT
    if isinstance(error, (KeyboardInterrupt, typer.Abort)):
        return "interrupted", INTERRUPTED
    if isinstance(error, MemoryError):
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
