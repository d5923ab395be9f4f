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
        typer.Option("--out", metavar="DIR", help="Output folder for atlas.json, atlas.md and "
                     "plots."),
    ] = None,
    only_list: Annotated[
        bool, typer.Option("--list", help="List the cases; nothing is computed.")
    ] = False,
    json: Json = False,
) -> None:  # fmt: skip
    """Locate the parameter values at which methods fail, and the range of each remedy."""
    if only_list:
        _list(case, json)
        return
    if out is None:
        raise typer.BadParameter("give the output folder, --out DIR, or --list")
    from mstmm.atlas import cases

    from .. import output
    from ..extras import install, missing

    left_out = [one for one in cases.chosen(case) if one.lacks and not case]
    folder, lacking = output_folder(out, "atlas.json"), missing("plot")
    atlas = _found(case)
    files = atlas.save(folder, pictures=not lacking)
    if json:
        paths, names = [str(file) for file in files], [one.name for one in left_out]
        output.emit_json({**atlas.to_dict(), "left_out": names, "files": paths})
        return
    _tell(atlas)
    output.say(f"{folder}: {', '.join(file.name for file in files)}")
    for one in left_out:
        output.say(f"left out: {one.name} needs {', '.join(one.lacks)}: {install(one.extra)}")
    if lacking:
        output.say(f"no plots: they need {', '.join(lacking)}: {install('plot')}")


def _list(wanted: list[str] | None, json: bool) -> None:
    from mstmm.atlas import cases

    from .. import output

    found = cases.chosen(wanted)
    if json:
        keys = ("name", "title", "parameter", "unit", "measured", "limit", "source")
        rows = [
            {key: getattr(one, key) for key in keys}
            | {"method": one.method.name, "remedy": one.remedy.name}
            for one in found
        ]
        output.emit_json({"cases": rows})
        return
    lines = [(one.name, one.title, one.parameter, one.remedy.name) for one in found]
    output.console().print(output.table("", ("case", "what", "parameter", "remedy"), lines))


def _found(wanted: list[str] | None) -> Atlas:
    from mstmm.atlas.atlas import stability as measured

    from ..progress import bar

    with bar() as shown:

        def progress(name: str, number: int, count: int) -> None:
            shown.label(f"case {name}")
            shown.share(number / count, f"{number} of {count} cases")

        return measured(wanted, progress=progress)


def _tell(atlas: Atlas) -> None:
    from mstmm.atlas.page import frontier, held_to, in_unit, limit

    from .. import output

    columns = ("case", "parameter", "fails", "limit>", "remedy", "holds to>")
    rows = [
        (one.name, in_unit(one), frontier(one), limit(one), one.remedy, held_to(one))
        for one in atlas.cases
    ]
    output.console().print(output.table("", columns, rows))
