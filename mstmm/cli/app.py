"""Application with all commands.  Importing this module loads typer and nothing heavier."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from mstmm.errors import Interrupted

from .cache import cache
from .check import check
from .demo import demo
from .doctor import doctor
from .export_robot import export_robot
from .generate import generate
from .graphics.plot import plot
from .graphics.report import report
from .graphics.view import view
from .import_robot import import_robot
from .list_elements import list_elements
from .show import show
from .simulate.command import simulate
from .studies.advise import advise
from .studies.chart import chart
from .studies.linear import frf, linearize, modes
from .studies.stability import stability


class CommandGroup(TyperGroup):
    """Group of the commands, which reports an interrupt, where typer would exit silently."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise Interrupted("interrupted") from None


app = typer.Typer(
    name="mstmm",
    cls=CommandGroup,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: 0 success, 1 internal error (please report), 2 invalid input, 3 missing "
    "software or permission, 4 numerical failure, 130 interrupted.",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        from mstmm.version import __version__

        from .terminal_output import print_lines

        print_lines(f"mstmm {__version__}")
        raise typer.Exit(0)


@app.callback(invoke_without_command=True)
def mstmm(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version", is_eager=True, callback=_print_version, help="Print the version."
        ),
    ] = False,
) -> None:
    """Multibody dynamics with transfer matrices: derive, generate, simulate."""
    if context.invoked_subcommand is None:
        from .terminal_output import write_stdout

        write_stdout(context.get_help())


app.command("demo")(demo)
app.command("simulate")(simulate)
app.command("view")(view)
app.command("report")(report)
app.command("plot")(plot)
app.command("chart")(chart)
app.command("advise")(advise)
app.command("linearize")(linearize)
app.command("modes")(modes)
app.command("frf")(frf)
app.command("check")(check)
app.command("import")(import_robot)
app.command("export")(export_robot)
app.command("list")(list_elements)
app.command("show")(show)
app.command("stability")(stability)
app.command("generate")(generate)
app.command("cache")(cache)
app.command("doctor")(doctor)
