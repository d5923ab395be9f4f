"""`mstmm stability`: measured limits of methods and of their remedies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ..options import Json, output_folder

if TYPE_CHECKING:
    from mstmm.atlas.atlas import Atlas


def stability(
    case: Annotated[
        list[str] | None,
        typer.Option("--case", metavar="NAME", help="Case to run; repeatable. [all]"),
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            "--out", metavar="DIR", help="Output folder for atlas.json, atlas.md and plots."
        ),
    ] = None,
    only_list: Annotated[
        bool, typer.Option("--list", help="List the cases; nothing is computed.")
    ] = False,
    json: Json = False,
) -> None:
    """Locate the parameter values at which methods fail, and the range of each remedy."""
    if only_list:
        _list_cases(case, json)
        return
    if out is None:
        raise typer.BadParameter("give the output folder, --out DIR, or --list")
    from mstmm.atlas import cases

    from .. import terminal_output
    from ..extra_checks import install_command, missing_packages

    omitted_cases = [
        definition for definition in cases.select_cases(case) if definition.lacks and not case
    ]
    folder, missing_plot_packages = output_folder(out, "atlas.json"), missing_packages("plot")
    atlas = _measure_atlas(case)
    files = atlas.save(folder, pictures=not missing_plot_packages)
    if json:
        paths, names = (
            [str(file) for file in files],
            [definition.name for definition in omitted_cases],
        )
        terminal_output.print_json({**atlas.to_dict(), "left_out": names, "files": paths})
        return
    _print_atlas(atlas)
    terminal_output.print_lines(f"{folder}: {', '.join(file.name for file in files)}")
    for definition in omitted_cases:
        terminal_output.print_lines(
            f"left out: {definition.name} needs {', '.join(definition.lacks)}: "
            f"{install_command(definition.extra)}"
        )
    if missing_plot_packages:
        terminal_output.print_lines(
            f"no plots: they need {', '.join(missing_plot_packages)}: {install_command('plot')}"
        )


def _list_cases(wanted: list[str] | None, json: bool) -> None:
    from mstmm.atlas import cases

    from .. import terminal_output

    definitions = cases.select_cases(wanted)
    if json:
        keys = ("name", "title", "parameter", "unit", "measured", "limit", "source")
        rows = [
            {key: getattr(definition, key) for key in keys}
            | {"method": definition.method.name, "remedy": definition.remedy.name}
            for definition in definitions
        ]
        terminal_output.print_json({"cases": rows})
        return
    lines = [
        (definition.name, definition.title, definition.parameter, definition.remedy.name)
        for definition in definitions
    ]
    terminal_output.table_console().print(
        terminal_output.build_table("", ("case", "what", "parameter", "remedy"), lines)
    )


def _measure_atlas(wanted: list[str] | None) -> Atlas:
    from mstmm.atlas.atlas import stability as measured

    from ..progress import progress_bar

    with progress_bar() as shown:

        def progress(name: str, number: int, count: int) -> None:
            shown.label(f"case {name}")
            shown.show_fraction(number / count, f"{number} of {count} cases")

        return measured(wanted, progress=progress)


def _print_atlas(atlas: Atlas) -> None:
    from mstmm.atlas.page import frontier_text, limit_text, parameter_with_unit, remedy_range

    from .. import terminal_output

    columns = ("case", "parameter", "fails", "limit>", "remedy", "holds to>")
    rows = [
        (
            case.name,
            parameter_with_unit(case),
            frontier_text(case),
            limit_text(case),
            case.remedy,
            remedy_range(case),
        )
        for case in atlas.cases
    ]
    terminal_output.table_console().print(terminal_output.build_table("", columns, rows))
