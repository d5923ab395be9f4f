"""`mstmm plot`: curves of saved results, several of them over each other."""

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
        typer.Argument(metavar="RESULT...", help="Saved results, .nc, .csv or .mat, drawn over "
                       "each other.", show_default=False),
    ],
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="What to draw, such as "
                     "shoulder.angle, rod1.tip.position, strut.force, energy; may be repeated.  By "
                     "default what moves most."),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option("--against", metavar="NAME", help="Draw over this quantity, not the time."),
    ] = None,
    phase: Annotated[
        bool, typer.Option("--phase", help="Draw the rate of each quantity over itself.")
    ] = False,
    spectrum: Annotated[
        bool, typer.Option("--spectrum", help="Draw amplitudes over the frequency, Hz.")
    ] = False,
    output: Annotated[
        list[str] | None,
        typer.Option("--output", "-o", metavar="FILE", help="Picture, .png, .svg or .pdf; may be "
                     "repeated.  By default a .png with the first result's name, here."),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", metavar="TEXT", help="Words above the picture.")
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Draw quantities of saved results: over time, over each other, as phase or spectrum."""
    from .. import output as terminal

    if (against is not None and (phase or spectrum)) or (phase and spectrum):
        raise MstmmError("--against, --phase, --spectrum: take one of them")
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
    """What is drawn, by labels: names of files, with their folders where these are alike."""
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
