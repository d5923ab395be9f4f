"""`mstmm plot`: plots of quantities of one or several saved results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import MstmmError

from ..extras import need_for
from ..options import Json, output_file, quoted

if TYPE_CHECKING:
    from mstmm.runtime.result.plotting.panels import Panel

RESULTS = (".nc", ".csv", ".mat")
PICTURES = (".png", ".svg", ".pdf")


def plot(
    results: Annotated[
        list[str],
        typer.Argument(metavar="RESULT...", help="Saved results, .nc, .csv or .mat, in one plot.",
                       show_default=False),
    ],
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="Quantity to plot, such as "
                     "shoulder.angle, rod1.tip.position, strut.force, energy; repeatable.  "
                     "Default: those that vary most."),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option("--against", metavar="NAME", help="Quantity on the horizontal axis instead of "
                     "time."),
    ] = None,
    phase: Annotated[
        bool, typer.Option("--phase", help="Phase plot: each quantity against its rate.")
    ] = False,
    spectrum: Annotated[
        bool, typer.Option("--spectrum", help="Amplitude spectrum, Hz.")
    ] = False,
    output: Annotated[
        list[str] | None,
        typer.Option("--output", "-o", metavar="FILE", help="Plot file: .png, .svg or .pdf; "
                     "repeatable.  Default: .png with the name of the first result, current "
                     "folder."),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", metavar="TEXT", help="Title of the figure.")
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Plot quantities of saved results: time series, phase plots, spectra."""
    from .. import output as terminal

    if (against is not None and (phase or spectrum)) or (phase and spectrum):
        raise MstmmError("--against, --phase, --spectrum: use only one of them")
    for name in results:
        if Path(name).suffix.lower() not in RESULTS:
            raise MstmmError(
                f"{quoted(name)}: expected a saved result, {', '.join(RESULTS)}; mstmm simulate "
                "writes them"
            )
    targets = [
        output_file(name, PICTURES) for name in output or [f"{Path(results[0]).stem or 'run'}.png"]
    ]
    for target in targets:
        need_for(target, "--output")
    runs = _runs(results)
    from mstmm.runtime.result.plotting.figure import drawn
    from mstmm.runtime.result.plotting.panels import Wanted

    kind = "phase" if phase else "spectrum" if spectrum else "time"
    made = drawn(runs, Wanted(tuple(quantity or ()), against, kind), title)
    for target in targets:
        made.write(target)
    if json:
        files, told = [str(path) for path in targets], [_to_json(one) for one in made.panels]
        terminal.emit_json(
            {"files": files, "runs": list(runs), "pictures": made.shapes, "panels": told}
        )
        return
    for one in made.panels:
        terminal.say(f"{one.title}: {', '.join(one.names)}")
        for note in one.notes:
            terminal.say(f"    {note}")
    terminal.say(f"wrote {' and '.join(map(str, targets))}")


def _runs(results: Sequence[str]) -> dict[str, Any]:
    """Results by label: names of files, with their folders if names are equal."""
    import mstmm

    paths = [Path(name) for name in dict.fromkeys(results)]
    labels = [path.stem for path in paths]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in paths]
    return {label: mstmm.load_result(path) for label, path in zip(labels, paths, strict=True)}


def _to_json(panel: Panel) -> dict[str, Any]:
    return {
        "title": panel.title, "x": panel.x, "kind": panel.kind, "names": panel.names,
        "curves": [trace.label for trace in panel.traces], "notes": panel.notes,
    }  # fmt: skip
