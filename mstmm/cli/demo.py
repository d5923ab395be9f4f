"""`mstmm demo`: an example from its scene to a certified result, a table and a plot."""

from __future__ import annotations

import time
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from .extras import install, missing, result_ending
from .models import load_method
from .options import Json, output_file
from .progress import bar

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result

#: Scene of examples/three_bodies_on_balls, included in the package.
SCENE = "three_bodies_on_balls.toml"
TITLE = "Three bodies on ball hinges"
T_END, SAMPLES = 5.0, 501

TABLE = ("body3.tip.x", "body3.tip.y", "body3.tip.z", "ball0.fz", "energy")
TRAIL = "body3.tip"
PICTURE = ("body3.tip.position", "ball0.force", "energy.kinetic", "energy.gravity", "energy")

ABOUT = """\
Three bodies on ball hinges, a chain swinging in space under gravity:

    ground --(ball0)-- body1 --(ball2)-- body2 --(ball4)-- body3 -- tip

the system of Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems,
Wiley 2019, section 5.10.1, with different data.  Each body and hinge is one
element; its equations were derived symbolically, printed as C and compiled when
mstmm was installed.  One sweep along the chain gives all accelerations."""

NEXT = """\
Next:
    mstmm simulate demo.toml --t-end 2     simulate the scene, after editing it
    mstmm show ball                        show the equations of a hinge
    mstmm list                             list all elements and methods"""


def scene_text() -> str:
    """Text of the scene file."""
    return files(__package__).joinpath(SCENE).read_text(encoding="utf-8")


def demo(json: Json = False) -> None:
    """Run an example and write its result, plots, animation and table to the current folder."""
    from mstmm.runtime.host.files import write_text

    from . import output, summary

    scene, result_file, table_file, picture, moving = _targets()
    kept = _write_scene(scene)
    result, seconds = _simulate(scene_text())
    verdict = result.certificate.verdict()
    text = "\n".join([
        ABOUT, "", *summary.verdict_lines(verdict, 80),
        f"{summary.sizes(result)}", summary.effort(result, seconds), "",
        result.table(*TABLE, rows=11), "", *summary.certificate_lines(result, 80),
    ])  # fmt: skip
    result.save(result_file)
    write_text(table_file, text + "\n")
    if picture is not None:
        result.plot(*PICTURE, path=picture, title=TITLE)
    if moving is not None:
        result.view(moving, trails=(TRAIL,), title=TITLE)
    made = {
        result_file: f"the result: {len(result.t)} samples of every quantity",
        table_file: "this text",
        scene: "the scene" if kept is None else kept,
    } | ({} if picture is None else {picture: "plots of the result"})
    made |= {} if moving is None else {moving: "an animation of the chain, for any browser"}
    if json:
        data = summary.to_json(result, seconds, verdict)
        output.emit_json({**data, "files": [str(path) for path in made]})
        return
    output.say(text)
    output.say()
    for path, what in made.items():
        output.say(f"{path!s:<11}{what}")
    for line in _without_extras():
        output.say(line)
    output.say()
    output.say(NEXT)


def _targets() -> tuple[Path, Path, Path, Path | None, Path | None]:
    """Output files: scene, result, table, plot, animation; None if a package is missing."""
    names = ["demo.toml", "demo" + result_ending(), "demo.txt"]
    scene, result, table = (output_file(name, (), "demo:") for name in names)
    picture = None if missing("plot") else output_file("demo.png", (), "demo:")
    moving = None if missing("view") else output_file("demo.html", (), "demo:")
    return scene, result, table, picture, moving


def _write_scene(path: Path) -> str | None:
    """Write the scene file; a file that differs is kept, which the returned text states."""
    from mstmm.runtime.host.files import write_text

    text = scene_text()
    if path.exists() and path.read_bytes() != text.encode():
        return "your modified scene, not overwritten"
    write_text(path, text)
    return None


def _simulate(text: str) -> tuple[Result, float]:
    import tomllib

    import mstmm
    from mstmm.runtime.model.results import certified

    model = mstmm.compile(mstmm.Scene(**tomllib.loads(text)))
    load_method("dop853")
    times = [T_END * i / (SAMPLES - 1) for i in range(SAMPLES)]
    with bar() as progress:
        begin = time.perf_counter()
        result = model.simulate(T_END, output_times=times, progress=progress)
        seconds = time.perf_counter() - begin
        progress.label("estimating the error")
        result = certified(result, progress)
    return result, seconds


def _without_extras() -> list[str]:
    lines = []
    if missing("plot"):
        lines.append(f"no plot: it needs {', '.join(missing('plot'))}: {install('plot')}")
    if missing("view"):
        lines.append(f"no animation: it needs {', '.join(missing('view'))}: {install('view')}")
    if missing("io"):
        lines.append(f"CSV, as NetCDF needs {', '.join(missing('io'))}: {install('io')}")
    return lines
