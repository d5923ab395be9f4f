"""`mstmm report`: a result as one page to read."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mstmm.errors import MstmmError

from ..extras import need_for
from ..options import Json, output_file
from .view import made


def report(
    result: Annotated[str, typer.Argument(metavar="RESULT", help="A saved result, .nc.")],
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="The page, .html; by default with the "
                     "result's name, here."),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="What the curves show, such as "
                     "rod1.tip.position; may be repeated.  By default what moves most."),
    ] = None,
    trail: Annotated[
        list[str] | None,
        typer.Option("--trail", metavar="END", help="An end whose way is drawn; may be repeated."),
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Write one page that tells a run: can it be trusted, how it moves, curves, equations."""
    from .. import output as terminal

    source = Path(result)
    if source.suffix.lower() != ".nc":
        raise MstmmError(f"{result}: expected a saved result, .nc; mstmm simulate writes them")
    target = output_file(output or f"{source.stem}.html", (".html",))
    need_for(target, "--output")
    need_for(target.with_suffix(".png"), "--output")
    import mstmm
    from mstmm.runtime.model.loading import load_netcdf

    run = load_netcdf(source)
    mstmm.report(
        run, target, title=source.stem, quantities=quantity or (), trails=tuple(trail or ())
    )
    if json:
        terminal.emit_json(made([target], run))
        return
    terminal.say(f"{target}: a page for any browser, without a network")
