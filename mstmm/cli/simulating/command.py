"""`mstmm simulate`: run a scene, save the result and report whether it can be trusted."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import NumericalFailure, SceneError

from ..extras import need_for, result_ending
from ..models import compiled, load_method, use_files
from ..options import (
    Elements,
    Json,
    Times,
    not_negative,
    output_file,
    positive,
    times,
    with_inputs,
)
from ..pictures.plot import PICTURES, RESULTS
from ..progress import bar
from .plan import Plan, refuse_beside_error, refuse_endless
from .running import kept_if_interrupted, kept_if_it_fails, run, saved
from .telling import interrupted, report, told_risks

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model


def simulate(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=positive, help="End time, s.")
    ] = 10.0,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", metavar="NAME", show_default=f"auto, {METHOD} with --step",
            help="Integration method, see `mstmm list methods`; auto chooses one."
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option("--step", metavar="S", parser=positive, help="Fixed time step, s; required by "
                     "fixed-step methods."),
    ] = None,
    rtol: Annotated[
        float | None,
        typer.Option("--rtol", metavar="X", parser=positive, show_default=f"{RTOL:g}",
                     help="Relative tolerance."),
    ] = None,
    atol: Annotated[
        float | None,
        typer.Option("--atol", metavar="X", parser=not_negative, show_default=f"{ATOL:g}",
                     help="Absolute tolerance."),
    ] = None,
    error: Annotated[
        float | None,
        typer.Option("--error", metavar="X", parser=positive, help="Target error of the whole run, "
                     "in place of tolerances: rad, or relative to the motion; several runs may be "
                     "made."),
    ] = None,
    of: Annotated[
        list[str] | None,
        typer.Option("--of", metavar="NAME", help="Quantity to which --error applies, in its unit, "
                     "such as rod1.tip.position; repeatable."),
    ] = None,
    max_step: Annotated[
        float | None,
        typer.Option("--max-step", metavar="S", parser=positive, help="Maximum time step of "
                     "adaptive methods, s; use it when a force is narrow."),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option("--radius", metavar="X", parser=not_negative, help="Spectral radius at "
                     "infinity of genalpha and dttmm, 0 to 1 (0.8)."),
    ] = None,
    times: Annotated[
        Times | None,
        typer.Option(
            "--times", metavar="N|DT", parser=times,
            help="Output times: a count (201) or an interval in s (0.05, 1s); default: every step.",
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Result file: .nc, .csv or .mat; "
                     "default: scene name, current folder."),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="Plot file: .png, .svg or .pdf."),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="Quantity to plot and print, such as "
                     "shoulder.angle, rod1.tip.position, energy; repeatable."),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="NAME=VALUE", help="Value of a scene input, or the name of "
                     "a signal; repeatable."),
    ] = None,
    hinge: Elements = None,
    certify: Annotated[
        bool | None,
        typer.Option("--certify/--no-certify", help="Estimate the error with a second, more "
                     "accurate run; default: after short runs."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted run, with the same options.")
    ] = False,
    sweep: Annotated[
        str,
        typer.Option("--sweep", metavar="NAME", help="Sweep: riccati; refined or qr for large mass "
                     "ratios; product (plain product, chains only); auto: the first that is "
                     "accurate enough at the start."),
    ] = "auto",
    engine: Annotated[
        str,
        typer.Option("--engine", metavar="NAME", help="auto, looped (generic C loop) or fused (C "
                     "compiled for this scene)."),
    ] = "auto",
    flexibility: Annotated[
        str | None,
        typer.Option("--flexibility", metavar="LEVEL", help="Model level of all flexible bodies: "
                     "coupled, one-way or rigid; default: as in the scene."),
    ] = None,
    scheme: Annotated[
        str,
        typer.Option("--scheme", metavar="NAME", help="Time scheme of dttmm-classical: "
                     "generalised-alpha, hht, newmark, wilson; parameter as in hht:0.3."),
    ] = "",
    iterations: Annotated[
        int,
        typer.Option("--iterations", metavar="N", help="Maximum Newton iterations per step of "
                     "dttmm-classical."),
    ] = 1,
    tangent: Annotated[
        str,
        typer.Option("--tangent", metavar="NAME", help="Tangent matrix of implicit methods: exact, "
                     "laws (hinge laws only) or auto."),
    ] = "auto",
    accuracy: Annotated[
        float | None,
        typer.Option("--accuracy", metavar="X", parser=positive, help="Largest estimated error of "
                     "a trusted result: rad, or relative to the motion (0.01)."),
    ] = None,
    on_risk: Annotated[
        str,
        typer.Option("--on-risk", metavar="ACTION", help="Action if the result is in doubt: warn; "
                     "refuse (before the run, else exit code 4 after saving); ignore."),
    ] = "warn",
    simplify: Annotated[
        bool,
        typer.Option("--simplify/--no-simplify", help="Merge bodies on fixed hinges, and snap "
                     "nearly right angles to exact ones."),
    ] = True,
    turns: Annotated[
        float | None,
        typer.Option("--turns", metavar="X", parser=not_negative, help="Tolerance for snapping to "
                     "right angles, rad (1e-11; 0 switches it off)."),
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Simulate a scene and save the result; Ctrl-C saves what has been computed."""
    plan = Plan(
        scene, t_end, method, step, rtol, atol, times,
        output_file(_default_output(scene) if output is None else output, RESULTS),
        None if plot is None else output_file(plot, PICTURES, "--plot"),
        tuple(quantity or ()), certify, resume, sweep, engine, flexibility, accuracy,
        max_step or 0.0, radius, scheme, iterations, tangent, error, tuple(of or ()),
        on_risk, tuple(inputs or ()), simplify, turns,
    )  # fmt: skip
    refuse_endless(plan)
    refuse_beside_error(plan)

    need_for(plan.output, "--output")
    if plan.plot is not None:
        need_for(plan.plot, "--plot")
    use_files(hinge or [])
    model = _model(plan)
    load_method(plan.method or METHOD)
    with bar() as progress, kept_if_interrupted(plan.checkpoint):
        begin = time.perf_counter()
        result, refused = run(plan, model, progress)
        seconds = time.perf_counter() - begin
        with kept_if_it_fails(plan.checkpoint):
            result = saved(plan, result, seconds, progress)
    if plan.plot is not None:
        result.plot(*plan.quantities, path=plan.plot, title=Path(plan.scene).stem)
    report(plan, result, seconds + result.trajectory.before, json, refused)
    if interrupted(result):
        raise typer.Exit(130)
    if not result.success:
        raise typer.Exit(NumericalFailure.exit_code)
    if refused is not None:
        raise typer.Exit(told_risks(plan, refused))


def _default_output(scene: str) -> str:
    stem = Path(scene).stem or "result"
    return stem + result_ending()


def _model(plan: Plan) -> Model:
    """Compile the scene, and check that it has all requested quantities."""
    import mstmm
    from mstmm.scene.rules.messages import near

    scene, level = mstmm.load_scene(plan.scene), plan.flexibility
    if plan.inputs:
        scene = with_inputs(scene, plan.inputs)
    turns = plan.simplify if plan.turns is None else plan.turns
    words = {"welds": plan.simplify, "turns": turns, "links": plan.simplify}
    model = compiled(plan.scene, scene, plan.sweep, plan.engine, level, words)
    if plan.quantities:
        start = model.simulate(t_end=0.0, method="dop853")
        pictures = start.pictures()
        for name in plan.quantities:
            try:
                if name not in pictures:
                    start.quantity(name)
            except SceneError as error:
                hint = near(name, pictures)
                meant = "did you mean" in hint
                text = f'"{name}": there is no such quantity or picture{hint}' if meant else error
                raise SceneError(f"--quantity {text}") from None
    return model
