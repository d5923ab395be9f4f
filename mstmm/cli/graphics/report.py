"""`mstmm report`: HTML report of a result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mstmm.errors import MstmmError

from ..extra_checks import require_extra_for
from ..options import Json, output_file
from .view import written_files


def report(
    result: Annotated[str, typer.Argument(metavar="RESULT", help="A saved result, .nc.")],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Report file, .html; default: result "
                     "name, current folder."),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="Quantity to plot, such as "
                     "rod1.tip.position; repeatable.  Default: those that vary most."),
    ] = None,
    trail: Annotated[
        list[str] | None,
        typer.Option("--trail", metavar="END", help="End whose path is drawn; repeatable."),
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Write an HTML report of a run: trustworthiness, animation, plots, equations."""
    from .. import terminal_output as terminal

    source = Path(result)
    if source.suffix.lower() != ".nc":
        raise MstmmError(f"{result}: expected a saved result, .nc; mstmm simulate writes them")
    target = output_file(output or f"{source.stem}.html", (".html",))
    require_extra_for(target, "--output")
    require_extra_for(target.with_suffix(".png"), "--output")
    import mstmm
    from mstmm.runtime.model.result_loading import load_netcdf

    run = load_netcdf(source)
    mstmm.write_report(
        run, target, title=source.stem, quantities=quantity or (), trails=tuple(trail or ())
    )
    if json:
        terminal.print_json(written_files([target], run))
        return
    terminal.print_lines(f"{target}: a page for any browser, usable offline")
