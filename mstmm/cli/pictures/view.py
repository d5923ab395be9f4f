"""`mstmm view`: animation, strip of frames, film or single frames of a scene or result."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.errors import MstmmError, OpenLoop

from ..extras import need_for
from ..models import compiled, load_method, use_files
from ..options import Elements, Json, output_file, output_folder, positive
from ..progress import bar

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result

ENDINGS = (".html", ".png", ".svg", ".pdf", ".gif", ".mp4")
_RESULT = ".nc"


def view(
    what: Annotated[
        str,
        typer.Argument(metavar="SCENE|RESULT", help="Scene (.toml, .json) or result (.nc)."),
    ],
    output: Annotated[
        list[str] | None,
        typer.Option("--output", "-o", metavar="FILE", help="Animation (.html), strip of frames "
                     "(.png, .svg, .pdf) or film (.gif, .mp4); repeatable.  Default: animation "
                     "with the name of the scene, current folder."),
    ] = None,
    frames: Annotated[
        str | None,
        typer.Option("--frames", metavar="FOLDER", help="Folder for the single frames of the film, "
                     ".png."),
    ] = None,
    t_end: Annotated[
        float | None,
        typer.Option("--t-end", metavar="S", parser=positive, help="Simulate the scene first, to "
                     "this time, s."),
    ] = None,
    trail: Annotated[
        list[str] | None,
        typer.Option("--trail", metavar="END", help="End whose path is drawn, such as rod2.tip; "
                     "repeatable."),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option("--speed", metavar="X", parser=positive, help="Playback speed: 0.1 is ten "
                     "times slower than real time."),
    ] = None,
    moments: Annotated[
        int, typer.Option("--moments", metavar="N", min=1, help="Number of frames in a strip.")
    ] = 6,
    hinge: Elements = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Animate a result, or draw a scene, in three dimensions."""
    from .. import output as terminal

    named = output or ([] if frames else [f"{Path(what).stem or 'scene'}.html"])
    targets = [output_file(name, ENDINGS) for name in named]
    if frames:
        targets.append(output_folder(frames, "frame_0001.png", "--frames"))
    for target in targets:
        need_for(target, "--output")
    use_files(hinge or [])
    title = title_of(Path(what))
    try:
        result, missing = _result(what, t_end), None
    except OpenLoop as error:
        result, missing = _nearest(what, error), error
        title = f"{title}: nearest pose, open by {error.gap:.3g}"
    seen = result.view(title=title, trails=tuple(trail or ()), speed=speed)
    for target in targets:
        seen.save(target, moments, title=missing is not None)
        if not json:
            about = "the nearest pose" if missing else _about(target, result)
            terminal.say(f"{target}: {about}")
    if json:
        terminal.emit_json(made(targets, result))
    if missing is not None:
        raise missing


def _result(what: str, t_end: float | None) -> Result:
    """Result to display: a saved one, a scene at its start, or a new run of a scene."""
    import mstmm
    from mstmm.runtime.model.loading import load_netcdf

    if Path(what).suffix.lower() == _RESULT:
        if t_end is not None:
            raise MstmmError(
                "--t-end: expected a scene, found a result; give the scene to run it again"
            )
        return load_netcdf(Path(what))
    model = compiled(what, mstmm.load_scene(what))
    if t_end is None:
        return model.simulate(t_end=0.0, method="dop853")
    load_method("auto")
    with bar() as progress:
        return model.simulate(t_end, method="auto", rtol=1e-7, atol=1e-10, progress=progress)


def _nearest(what: str, error: OpenLoop) -> Result:
    import mstmm
    from mstmm.bridge.nearest import nearest

    return nearest(mstmm.load_scene(what), error)


def made(targets: Sequence[Path], result: Result) -> dict[str, Any]:
    """Files written and time span of the run, for JSON."""
    return {
        "files": [str(target) for target in targets],
        "t_start": float(result.t[0]), "t_end": float(result.t[-1]), "samples": len(result.t),
    }  # fmt: skip


def _about(target: Path, result: Result) -> str:
    what = {
        ".html": "a page for any browser, usable offline",
        ".gif": "a film",
        ".mp4": "a film",
    }
    kind = what.get(target.suffix.lower(), "pictures")
    moves = len(result.t) > 1
    return (
        f"{kind}, t = {result.t[0]:g} to {result.t[-1]:g} s" if moves else f"{kind}, at the start"
    )


def title_of(path: Path) -> str:
    """Name of the file, or of its folder if the file is named "scene"."""
    return path.absolute().parent.name if path.stem == "scene" else path.stem
