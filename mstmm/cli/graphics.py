"""`mstmm view`, `mstmm plot` and `mstmm report`: animations, plots and reports of runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import LoopClosureError, MstmmError

from .model_loading import compile_file, generate_elements, load_method
from .options import (
    PLOT_ENDINGS,
    RESULT_ENDINGS,
    VIEW_ENDINGS,
    Elements,
    Json,
    flag,
    option,
    output_file,
    output_folder,
    parse_positive,
    quote,
    require_extra_for,
    title_from_path,
)
from .progress import progress_bar
from .terminal_output import print_json, print_lines

if TYPE_CHECKING:
    from mstmm.runtime.result.plotting.panels import Panel
    from mstmm.runtime.result.result import Result

_VIEW_OUTPUT_HELP = (
    "Animation (.html), strip of frames (.png, .svg, .pdf) or film (.gif, .mp4); repeatable.  "
    "Default: animation with the name of the scene, current folder."
)
_FRAMES_HELP = "Folder for the single frames of the film, .png."
_VIEW_END_HELP = "Simulate the scene first, to this time, s."
_VIEW_TRAIL_HELP = "End whose path is drawn, such as rod2.tip; repeatable."
_SPEED_HELP = "Playback speed: 0.1 is ten times slower than real time."
_PLOT_QUANTITY_HELP = (
    "Quantity to plot, such as shoulder.angle, rod1.tip.position, strut.force, energy; "
    "repeatable.  Default: those that vary most."
)
_PLOT_OUTPUT_HELP = (
    "Plot file: .png, .svg or .pdf; repeatable.  Default: .png with the name of the first result, "
    "current folder."
)
_REPORT_OUTPUT_HELP = "Report file, .html; default: result name, current folder."
_REPORT_QUANTITY_HELP = (
    "Quantity to plot, such as rod1.tip.position; repeatable.  Default: those that vary most."
)


def _targets(names: Sequence[str], endings: Sequence[str]) -> list[Path]:
    """Checked output files, with the packages that they need."""
    targets = [output_file(name, endings) for name in names]
    for target in targets:
        require_extra_for(target, "--output")
    return targets


# --- animations -----------------------------------------------------------------------------------


def view(
    what: Annotated[
        str, typer.Argument(metavar="SCENE|RESULT", help="Scene (.toml, .json) or result (.nc).")
    ],
    output: Annotated[list[str] | None, option("--output/-o", "FILE", _VIEW_OUTPUT_HELP)] = None,
    frames: Annotated[str | None, option("--frames", "FOLDER", _FRAMES_HELP)] = None,
    t_end: Annotated[float | None, option("--t-end", "S", _VIEW_END_HELP, parse_positive)] = None,
    trail: Annotated[list[str] | None, option("--trail", "END", _VIEW_TRAIL_HELP)] = None,
    speed: Annotated[float | None, option("--speed", "X", _SPEED_HELP, parse_positive)] = None,
    moments: Annotated[int, option("--moments", "N", "Number of frames in a strip.", min=1)] = 6,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Animate a result, or draw a scene, in three dimensions."""
    names = output or ([] if frames else [f"{Path(what).stem or 'scene'}.html"])
    targets = _targets(names, VIEW_ENDINGS)
    if frames:
        targets.append(output_folder(frames, "frame_0001.png", "--frames"))
    generate_elements(hinge or [])
    title = title_from_path(Path(what))
    try:
        result, open_loop = _load_result(what, t_end), None
    except LoopClosureError as error:
        result, open_loop = _nearest_result(what, error), error
        title = f"{title}: nearest pose, open by {error.gap:.3g}"
    result_view = result.view(title=title, trails=tuple(trail or ()), speed=speed)
    for target in targets:
        result_view.save(target, moments, title=open_loop is not None)
        if not json:
            description = "the nearest pose" if open_loop else _describe_file(target, result)
            print_lines(f"{target}: {description}")
    if json:
        print_json(_written_files(targets, result))
    if open_loop is not None:
        raise open_loop


def _load_result(what: str, t_end: float | None) -> Result:
    """Result to display: a saved one, a scene at its start, or a new run of a scene."""
    import mstmm
    from mstmm.runtime.experiments.run_request import Execution
    from mstmm.runtime.model.result_loading import load_netcdf

    if Path(what).suffix.lower() == ".nc":
        if t_end is not None:
            raise MstmmError(
                "--t-end: expected a scene, found a result; give the scene to run it again"
            )
        return load_netcdf(Path(what))
    model = compile_file(what, mstmm.load_scene(what))
    if t_end is None:
        return model.simulate(t_end=0.0, method="dop853")
    load_method("auto")
    with progress_bar() as progress:
        return model.simulate(
            t_end, method="auto", rtol=1e-7, atol=1e-10, execution=Execution(progress=progress)
        )


def _nearest_result(what: str, error: LoopClosureError) -> Result:
    import mstmm
    from mstmm.pipeline.assembled_scene import nearest_pose_result

    return nearest_pose_result(mstmm.load_scene(what), error)


def _written_files(targets: Sequence[Path], result: Result) -> dict[str, Any]:
    """Files written and time span of the run, for JSON."""
    return {
        "files": [str(target) for target in targets],
        "t_start": float(result.t[0]), "t_end": float(result.t[-1]), "samples": len(result.t),
    }  # fmt: skip


_FILE_DESCRIPTIONS = {
    ".html": "a page for any browser, usable offline", ".gif": "a film", ".mp4": "a film",
}  # fmt: skip


def _describe_file(target: Path, result: Result) -> str:
    kind = _FILE_DESCRIPTIONS.get(target.suffix.lower(), "pictures")
    if len(result.t) > 1:
        return f"{kind}, t = {result.t[0]:g} to {result.t[-1]:g} s"
    return f"{kind}, at the start"


# --- plots ----------------------------------------------------------------------------------------


def plot(
    results: Annotated[
        list[str],
        typer.Argument(
            metavar="RESULT...", help="Saved results, .nc, .csv or .mat, in one plot.",
            show_default=False,
        ),
    ],
    quantity: Annotated[
        list[str] | None, option("--quantity/-q", "NAME", _PLOT_QUANTITY_HELP)
    ] = None,
    against: Annotated[
        str | None, option("--against", "NAME", "Quantity on the horizontal axis instead of time.")
    ] = None,
    phase: Annotated[bool, flag("--phase", "Phase plot: each quantity against its rate.")] = False,
    spectrum: Annotated[bool, flag("--spectrum", "Amplitude spectrum, Hz.")] = False,
    output: Annotated[list[str] | None, option("--output/-o", "FILE", _PLOT_OUTPUT_HELP)] = None,
    title: Annotated[str | None, option("--title", "TEXT", "Title of the figure.")] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Plot quantities of saved results: time series, phase plots, spectra."""
    if (against is not None and (phase or spectrum)) or (phase and spectrum):
        raise MstmmError("--against, --phase, --spectrum: use only one of them")
    for name in results:
        if Path(name).suffix.lower() not in RESULT_ENDINGS:
            raise MstmmError(
                f"{quote(name)}: expected a saved result, {', '.join(RESULT_ENDINGS)}; mstmm "
                "simulate writes them"
            )
    targets = _targets(output or [f"{Path(results[0]).stem or 'run'}.png"], PLOT_ENDINGS)
    runs = _load_runs(results)
    from mstmm.runtime.result.plotting.figure import draw_runs
    from mstmm.runtime.result.plotting.panels import PlotSelection

    kind = "phase" if phase else "spectrum" if spectrum else "time"
    figure = draw_runs(runs, PlotSelection(tuple(quantity or ()), against, kind), title)
    for target in targets:
        figure.write(target)
    if json:
        print_json({
            "files": [str(path) for path in targets], "runs": list(runs),
            "pictures": figure.shapes, "panels": [_panel_data(panel) for panel in figure.panels],
        })  # fmt: skip
        return
    for panel in figure.panels:
        print_lines(f"{panel.title}: {', '.join(panel.names)}")
        for note in panel.notes:
            print_lines(f"    {note}")
    print_lines(f"wrote {' and '.join(map(str, targets))}")


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


# --- reports --------------------------------------------------------------------------------------


def report(
    result: Annotated[str, typer.Argument(metavar="RESULT", help="A saved result, .nc.")],
    output: Annotated[str | None, option("--output/-o", "FILE", _REPORT_OUTPUT_HELP)] = None,
    quantity: Annotated[
        list[str] | None, option("--quantity/-q", "NAME", _REPORT_QUANTITY_HELP)
    ] = None,
    trail: Annotated[
        list[str] | None, option("--trail", "END", "End whose path is drawn; repeatable.")
    ] = None,
    json: Json = False,
) -> None:
    """Write an HTML report of a run: trustworthiness, animation, plots, equations."""
    source = Path(result)
    if source.suffix.lower() != ".nc":
        raise MstmmError(f"{result}: expected a saved result, .nc; mstmm simulate writes them")
    (target,) = _targets([output or f"{source.stem}.html"], (".html",))
    require_extra_for(target.with_suffix(".png"), "--output")
    import mstmm
    from mstmm.runtime.model.result_loading import load_netcdf

    run = load_netcdf(source)
    mstmm.write_report(
        run, target, title=source.stem, quantities=quantity or (), trails=tuple(trail or ())
    )
    if json:
        print_json(_written_files([target], run))
    else:
        print_lines(f"{target}: a page for any browser, usable offline")
