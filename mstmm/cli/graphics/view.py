"""`mstmm view`: animation, strip of frames, film or single frames of a scene or result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import LoopClosureError, MstmmError

from ..extra_checks import require_extra_for
from ..model_loading import compile_file, generate_elements, load_method
from ..options import Elements, Json, output_file, output_folder, parse_positive
from ..progress import progress_bar

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result

VIEW_ENDINGS = (".html", ".png", ".svg", ".pdf", ".gif", ".mp4")
_RESULT_ENDING = ".nc"


def view(
    what: Annotated[
        str, typer.Argument(metavar="SCENE|RESULT", help="Scene (.toml, .json) or result (.nc).")
    ],
    output: Annotated[
        list[str] | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Animation (.html), strip of frames "
            "(.png, .svg, .pdf) or film (.gif, .mp4); repeatable.  Default: animation "
            "with the name of the scene, current folder.",
        ),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option(
            "--frames", metavar="FOLDER", help="Folder for the single frames of the film, .png."
        ),
    ] = None,
    t_end: Annotated[
        float | None,
        typer.Option(
            "--t-end",
            metavar="S",
            parser=parse_positive,
            help="Simulate the scene first, to this time, s.",
        ),
    ] = None,
    trail: Annotated[
        list[str] | None,
        typer.Option(
            "--trail", metavar="END", help="End whose path is drawn, such as rod2.tip; repeatable."
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed",
            metavar="X",
            parser=parse_positive,
            help="Playback speed: 0.1 is ten times slower than real time.",
        ),
    ] = None,
    moments: Annotated[
        int, typer.Option("--moments", metavar="N", min=1, help="Number of frames in a strip.")
    ] = 6,
    hinge: Elements = None,
    json: Json = False,
) -> None:
    """Animate a result, or draw a scene, in three dimensions."""
    from .. import terminal_output as terminal

    names = output or ([] if frames else [f"{Path(what).stem or 'scene'}.html"])
    targets = [output_file(name, VIEW_ENDINGS) for name in names]
    if frames:
        targets.append(output_folder(frames, "frame_0001.png", "--frames"))
    for target in targets:
        require_extra_for(target, "--output")
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
            terminal.print_lines(f"{target}: {description}")
    if json:
        terminal.print_json(written_files(targets, result))
    if open_loop is not None:
        raise open_loop


def _load_result(what: str, t_end: float | None) -> Result:
    """Result to display: a saved one, a scene at its start, or a new run of a scene."""
    import mstmm
    from mstmm.runtime.model.execution import Execution
    from mstmm.runtime.model.result_loading import load_netcdf

    if Path(what).suffix.lower() == _RESULT_ENDING:
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
    from mstmm.pipeline.nearest_pose import nearest_pose_result

    return nearest_pose_result(mstmm.load_scene(what), error)


def written_files(targets: Sequence[Path], result: Result) -> dict[str, Any]:
    """Files written and time span of the run, for JSON."""
    return {
        "files": [str(target) for target in targets],
        "t_start": float(result.t[0]), "t_end": float(result.t[-1]), "samples": len(result.t),
    }  # fmt: skip


def _describe_file(target: Path, result: Result) -> str:
    descriptions = {
        ".html": "a page for any browser, usable offline",
        ".gif": "a film",
        ".mp4": "a film",
    }
    kind = descriptions.get(target.suffix.lower(), "pictures")
    is_animated = len(result.t) > 1
    return (
        f"{kind}, t = {result.t[0]:g} to {result.t[-1]:g} s"
        if is_animated
        else f"{kind}, at the start"
    )


def title_from_path(path: Path) -> str:
    """Name of the file, or of its folder if the file is named "scene"."""
    return path.absolute().parent.name if path.stem == "scene" else path.stem
