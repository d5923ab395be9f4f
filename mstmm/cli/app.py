"""Application with all commands.  Importing this module loads typer and nothing heavier.

The module of a command is loaded when the command runs, or when the help lists all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from mstmm.errors import Interrupted

from .options import flat_options

#: Command -> module and function, in the order of the help.
_COMMANDS = {
    "demo": ("demo", "demo"),
    "simulate": ("simulate", "simulate"),
    "view": ("graphics", "view"),
    "report": ("graphics", "report"),
    "plot": ("graphics", "plot"),
    "chart": ("experiments", "chart"),
    "advise": ("experiments", "advise"),
    "linearize": ("linear", "linearize"),
    "modes": ("linear", "modes"),
    "frf": ("linear", "frf"),
    "check": ("check", "check"),
    "import": ("robots", "import_robot"),
    "export": ("robots", "export_robot"),
    "list": ("list_elements", "list_elements"),
    "show": ("show", "show"),
    "stability": ("stability", "stability"),
    "generate": ("generate", "generate"),
    "cache": ("cache", "cache"),
    "doctor": ("doctor", "doctor"),
}


class _Commands(Mapping[str, Any]):
    """Commands by name, each loaded at its first use."""

    def __init__(self) -> None:
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            module, function = _COMMANDS[name]
            run = getattr(import_module(f".{module}", __package__), function)
            single = typer.Typer(add_completion=False, rich_markup_mode=app.rich_markup_mode)
            single.command(name)(flat_options(run))
            self._loaded[name] = typer.main.get_command(single)
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(_COMMANDS)

    def __len__(self) -> int:
        return len(_COMMANDS)


class CommandGroup(TyperGroup):
    """Group of the commands, which reports an interrupt, where typer would exit silently."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        self.commands = _Commands()  # type: ignore[assignment]  # read only

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
