"""`mstmm plot`: plots of quantities of one or several saved results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import MstmmError

from ..extra_checks import require_extra_for
from ..options import Json, output_file, quote

if TYPE_CHECKING:
    from mstmm.runtime.result.plotting.panels import Panel

RESULT_ENDINGS = (".nc", ".csv", ".mat")
PLOT_ENDINGS = (".png", ".svg", ".pdf")


def plot(
    results: Annotated[
        list[str],
        typer.Argument(
            metavar="RESULT...",
            help="Saved results, .nc, .csv or .mat, in one plot.",
            show_default=False,
        ),
    ],
    quantity: Annotated[
        list[str] | None,
        typer.Option(
            "--quantity",
            "-q",
            metavar="NAME",
            help="Quantity to plot, such as "
            "shoulder.angle, rod1.tip.position, strut.force, energy; repeatable.  "
            "Default: those that vary most.",
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(
            "--against", metavar="NAME", help="Quantity on the horizontal axis instead of time."
        ),
    ] = None,
    phase: Annotated[
        bool, typer.Option("--phase", help="Phase plot: each quantity against its rate.")
    ] = False,
    spectrum: Annotated[bool, typer.Option("--spectrum", help="Amplitude spectrum, Hz.")] = False,
    output: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Plot file: .png, .svg or .pdf; "
            "repeatable.  Default: .png with the name of the first result, current folder.",
        ),
    ] = None,
    title: Annotated[
        str | None, typer.Option("--title", metavar="TEXT", help="Title of the figure.")
    ] = None,
    json: Json = False,
) -> None:
    """Plot quantities of saved results: time series, phase plots, spectra."""
    from .. import terminal_output as terminal

    if (against is not None and (phase or spectrum)) or (phase and spectrum):
        raise MstmmError("--against, --phase, --spectrum: use only one of them")
    for name in results:
        if Path(name).suffix.lower() not in RESULT_ENDINGS:
            raise MstmmError(
                f"{quote(name)}: expected a saved result, {', '.join(RESULT_ENDINGS)}; mstmm "
                "simulate writes them"
            )
    targets = [
        output_file(name, PLOT_ENDINGS)
        for name in output or [f"{Path(results[0]).stem or 'run'}.png"]
    ]
    for target in targets:
        require_extra_for(target, "--output")
    runs = _load_runs(results)
    from mstmm.runtime.result.plotting.figure import draw_runs
    from mstmm.runtime.result.plotting.panels import PlotSelection

    kind = "phase" if phase else "spectrum" if spectrum else "time"
    figure = draw_runs(runs, PlotSelection(tuple(quantity or ()), against, kind), title)
    for target in targets:
        figure.write(target)
    if json:
        files, panel_data = (
            [str(path) for path in targets],
            [_panel_data(panel) for panel in figure.panels],
        )
        terminal.print_json(
            {"files": files, "runs": list(runs), "pictures": figure.shapes, "panels": panel_data}
        )
        return
    for panel in figure.panels:
        terminal.print_lines(f"{panel.title}: {', '.join(panel.names)}")
        for note in panel.notes:
            terminal.print_lines(f"    {note}")
    terminal.print_lines(f"wrote {' and '.join(map(str, targets))}")


def _load_runs(results: Sequence[str]) -> dict[str, Any]:
    """Results by label: names of files, with their folders if names are equal."""
    import mstmm

    paths = [Path(name) for name in dict.fromkeys(results)]
    labels = [path.stem for path in paths]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in paths]
    return {label: mstmm.load_result(path) for label, path in zip(labels, paths, strict=True)}


def _panel_data(panel: Panel) -> dict[str, Any]:
    return {
        "title": panel.title, "x": panel.x, "kind": panel.kind, "names": panel.names,
        "curves": [trace.label for trace in panel.traces], "notes": panel.notes,
    }  # fmt: skip
