"""`mstmm demo`: an example from its scene to a certified result, a table and a plot."""

from __future__ import annotations

import time
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from mstmm.optional_packages import missing_packages

from . import run_summary
from .model_loading import load_method
from .options import Json, missing_extra, output_file, result_ending
from .progress import progress_bar
from .terminal_output import print_json, print_lines

if TYPE_CHECKING:
    from mstmm.runtime.result.result import Result

#: Scene of examples/three_bodies_on_balls, included in the package.
SCENE = "three_bodies_on_balls.toml"
TITLE = "Three bodies on ball hinges"
T_END, SAMPLES = 5.0, 501

TABLE_QUANTITIES = ("body3.tip.x", "body3.tip.y", "body3.tip.z", "ball0.fz", "energy")
TRAIL_END = "body3.tip"
PLOT_QUANTITIES = (
    "body3.tip.position", "ball0.force", "energy.kinetic", "energy.gravity", "energy",
)  # fmt: skip

INTRODUCTION = """\
Three bodies on ball hinges, a chain swinging in space under gravity:

    ground --(ball0)-- body1 --(ball2)-- body2 --(ball4)-- body3 -- tip

the system of Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems,
Wiley 2019, section 5.10.1, with different data.  Each body and hinge is one
element; its equations were derived symbolically, printed as C and compiled when
mstmm was installed.  One sweep along the chain gives all accelerations."""

NEXT_STEPS = """\
Next:
    mstmm simulate demo.toml --t-end 2     simulate the scene, after editing it
    mstmm show ball                        show the equations of a hinge
    mstmm list                             list all elements and methods"""


def scene_text() -> str:
    """Text of the scene file."""
    return files(__package__).joinpath(SCENE).read_text(encoding="utf-8")


def demo(json: Json = False) -> None:
    """Run an example and write its result, plots, animation and table to the current folder."""
    from mstmm.runtime.platform_support.safe_files import write_text

    scene, result_file, table_file, picture, animation = _output_files()
    kept_note = _write_scene(scene)
    result, seconds = _simulate(scene_text())
    verdict = result.certificate.verdict()
    text = "\n".join([
        INTRODUCTION, "", *run_summary.verdict_lines(verdict, 80),
        f"{run_summary.size_text(result)}", run_summary.effort_text(result, seconds), "",
        result.table(*TABLE_QUANTITIES, rows=11), "", *run_summary.certificate_lines(result, 80),
    ])  # fmt: skip
    result.save(result_file)
    write_text(table_file, text + "\n")
    if picture is not None:
        result.plot(*PLOT_QUANTITIES, path=picture, title=TITLE)
    if animation is not None:
        result.view(animation, trails=(TRAIL_END,), title=TITLE)
    descriptions = {
        result_file: f"the result: {len(result.t)} samples of every quantity",
        table_file: "this text",
        scene: "the scene" if kept_note is None else kept_note,
    }
    if picture is not None:
        descriptions[picture] = "plots of the result"
    if animation is not None:
        descriptions[animation] = "an animation of the chain, for any browser"
    if json:
        data = run_summary.to_json(result, seconds, verdict)
        print_json({**data, "files": [str(path) for path in descriptions]})
        return
    print_lines(text)
    print_lines()
    for path, description in descriptions.items():
        print_lines(f"{path!s:<11}{description}")
    for line in (
        *missing_extra("no plot: it needs", "plot"),
        *missing_extra("no animation: it needs", "view"),
        *missing_extra("CSV, as NetCDF needs", "io"),
    ):
        print_lines(line)
    print_lines()
    print_lines(NEXT_STEPS)


def _output_files() -> tuple[Path, Path, Path, Path | None, Path | None]:
    """Output files: scene, result, table, plot, animation; None if a package is missing."""
    names = ["demo.toml", "demo" + result_ending(), "demo.txt"]
    scene, result, table = (output_file(name, (), "demo:") for name in names)
    picture = None if missing_packages("plot") else output_file("demo.png", (), "demo:")
    animation = None if missing_packages("view") else output_file("demo.html", (), "demo:")
    return scene, result, table, picture, animation


def _write_scene(path: Path) -> str | None:
    """Write the scene file; a file that differs is kept, which the returned text states."""
    from mstmm.runtime.platform_support.safe_files import write_text

    text = scene_text()
    if path.exists() and path.read_bytes() != text.encode():
        return "your modified scene, not overwritten"
    write_text(path, text)
    return None


def _simulate(text: str) -> tuple[Result, float]:
    import tomllib

    import mstmm
    from mstmm.runtime.experiments.run_request import Execution
    from mstmm.runtime.experiments.run_results import certify_result

    model = mstmm.compile(mstmm.Scene(**tomllib.loads(text)))
    load_method("dop853")
    times = [T_END * i / (SAMPLES - 1) for i in range(SAMPLES)]
    with progress_bar() as progress:
        start_time = time.perf_counter()
        result = model.simulate(T_END, output_times=times, execution=Execution(progress=progress))
        seconds = time.perf_counter() - start_time
        progress.label("estimating the error")
        result = certify_result(result, progress)
    return result, seconds
