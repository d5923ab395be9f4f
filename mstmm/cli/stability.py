"""`mstmm stability`: measured limits of methods and of their remedies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from .options import Json, flag, install_command, missing_extra, option, output_folder
from .progress import progress_bar
from .terminal_output import build_table, print_json, print_lines, table_console

if TYPE_CHECKING:
    from mstmm.atlas.atlas import Atlas


def stability(
    case: Annotated[
        list[str] | None, option("--case", "NAME", "Case to run; repeatable. [all]")
    ] = None,
    out: Annotated[
        str | None, option("--out", "DIR", "Output folder for atlas.json, atlas.md and plots.")
    ] = None,
    only_list: Annotated[bool, flag("--list", "List the cases; nothing is computed.")] = False,
    json: Json = False,
) -> None:
    """Locate the parameter values at which methods fail, and the range of each remedy."""
    if only_list:
        _list_cases(case, json)
        return
    if out is None:
        raise typer.BadParameter("give the output folder, --out DIR, or --list")
    from mstmm.atlas import cases

    omitted_cases = [
        definition for definition in cases.select_cases(case) if definition.lacks and not case
    ]
    folder, no_plots = (
        output_folder(out, "atlas.json"),
        missing_extra("no plots: they need", "plot"),
    )
    atlas = _measure_atlas(case)
    files = atlas.save(folder, pictures=not no_plots)
    if json:
        names = [definition.name for definition in omitted_cases]
        print_json({**atlas.to_dict(), "left_out": names, "files": [str(file) for file in files]})
        return
    _print_atlas(atlas)
    print_lines(f"{folder}: {', '.join(file.name for file in files)}")
    for definition in omitted_cases:
        print_lines(
            f"left out: {definition.name} needs {', '.join(definition.lacks)}: "
            f"{install_command(definition.extra)}"
        )
    for line in no_plots:
        print_lines(line)


def _list_cases(wanted: list[str] | None, json: bool) -> None:
    from mstmm.atlas import cases

    definitions = cases.select_cases(wanted)
    if json:
        keys = ("name", "title", "parameter", "unit", "measured", "limit", "source")
        rows = [
            {key: getattr(definition, key) for key in keys}
            | {"method": definition.method.name, "remedy": definition.remedy.name}
            for definition in definitions
        ]
        print_json({"cases": rows})
        return
    lines = [(case.name, case.title, case.parameter, case.remedy.name) for case in definitions]
    table_console().print(build_table("", ("case", "what", "parameter", "remedy"), lines))


def _measure_atlas(wanted: list[str] | None) -> Atlas:
    from mstmm.atlas.atlas import stability as measured

    with progress_bar() as shown:

        def progress(name: str, number: int, count: int) -> None:
            shown.label(f"case {name}")
            shown.show_fraction(number / count, f"{number} of {count} cases")

        return measured(wanted, progress=progress)


def _print_atlas(atlas: Atlas) -> None:
    from mstmm.atlas.page import frontier_text, limit_text, parameter_with_unit, remedy_range

    columns = ("case", "parameter", "fails", "limit>", "remedy", "holds to>")
    rows = [
        (case.name, parameter_with_unit(case), frontier_text(case), limit_text(case), case.remedy,
         remedy_range(case))
        for case in atlas.cases
    ]  # fmt: skip
    table_console().print(build_table("", columns, rows))
