"""`mstmm simulate`: run a scene, keep what was computed, say how far it can be trusted."""

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
        float, typer.Option("--t-end", metavar="S", parser=positive, help="End of the run, s.")
    ] = 10.0,
    method: Annotated[
        str | None,
        typer.Option(
            "--method", metavar="NAME", show_default=f"auto, {METHOD} with --step",
            help="auto, which chooses; dop853, dopri5, pirk13, rk4; for stiff motion rodas4p2, "
            "rodas5p, rodas4, ros34pw2, rodas4pw, esdirk436, kvaerno5, genalpha, dttmm, hht, "
            "newmark, wilson, houbolt, genalpha-index3, hht-index3; exprb32 for undamped "
            "vibration; dttmm-classical, dttmm-classical-product; scipy-DOP853, -RK45, "
            "-RK23, -Radau, -BDF, -LSODA; sundials-BDF, -Adams.  mstmm list tells of each."
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option("--step", metavar="S", parser=positive, help="Fixed step, s; some need it."),
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
        typer.Option("--error", metavar="X", parser=positive, help="Error wanted of the whole run, "
                     "instead of tolerances: rad, or part of the motion; several runs reach it."),
    ] = None,
    of: Annotated[
        list[str] | None,
        typer.Option("--of", metavar="NAME", help="Quantity whose error --error is, in its unit, "
                     "such as rod1.tip.position; may be repeated."),
    ] = None,
    max_step: Annotated[
        float | None,
        typer.Option("--max-step", metavar="S", parser=positive, help="Longest step of a method "
                     "that chooses its steps, s: no narrow part of a force is passed over."),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option("--radius", metavar="X", parser=not_negative, help="Spectral radius, 0 to 1, "
                     "that genalpha and dttmm leave to infinitely fast motion (0.8)."),
    ] = None,
    times: Annotated[
        Times | None,
        typer.Option(
            "--times", metavar="N|DT", parser=times,
            help="Samples: how many (201), or how far apart in s (0.05, 1s); else every step.",
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("--output", "-o", metavar="FILE", help="Result, .nc, .csv or .mat; by default "
                     "the scene's name, here."),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="Picture, .png, .svg or .pdf."),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option("--quantity", "-q", metavar="NAME", help="What to plot and to print, such as "
                     "shoulder.angle, rod1.tip.position, energy; may be repeated."),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option("--input", metavar="NAME=VALUE", help="What an input of the scene is: a "
                     "number, or the name of a signal of it; may be repeated."),
    ] = None,
    hinge: Elements = None,
    certify: Annotated[
        bool | None,
        typer.Option("--certify/--no-certify", help="Estimate the error by a second, more accurate "
                     "run; by default after short runs."),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted run, with the same options.")
    ] = False,
    sweep: Annotated[
        str,
        typer.Option("--sweep", metavar="NAME", help="riccati, refined: for heavy bodies behind "
                     "light ones, qr: as least squares, for any ratio of masses, auto: the first "
                     "of these that keeps the start's digits, or product: the plain product of "
                     "transfer matrices, for chains, guarded."),
    ] = "auto",
    engine: Annotated[
        str,
        typer.Option("--engine", metavar="NAME", help="auto, looped, or fused: code compiled for "
                     "this scene."),
    ] = "auto",
    flexibility: Annotated[
        str | None,
        typer.Option("--flexibility", metavar="LEVEL", help="coupled, one-way, or rigid: level of "
                     "model of all flexible bodies; by default as the scene says."),
    ] = None,
    scheme: Annotated[
        str,
        typer.Option("--scheme", metavar="NAME", help="Of dttmm-classical: generalised-alpha, hht, "
                     "newmark or wilson, with a number as in hht:0.3."),
    ] = "",
    iterations: Annotated[
        int,
        typer.Option("--iterations", metavar="N", help="Of dttmm-classical: linear solutions that "
                     "a step may take."),
    ] = 1,
    tangent: Annotated[
        str,
        typer.Option("--tangent", metavar="NAME", help="Of implicit methods: auto, exact, or laws, "
                     "the slopes of hinges' laws alone, for those that allow it."),
    ] = "auto",
    accuracy: Annotated[
        float | None,
        typer.Option("--accuracy", metavar="X", parser=positive, help="Error up to which the "
                     "result counts as trusted: rad, or part of the motion (0.01)."),
    ] = None,
    on_risk: Annotated[
        str,
        typer.Option("--on-risk", metavar="WORD", help="Where something speaks against the "
                     "numbers: warn; refuse, before the run where it is seen there, else with "
                     "exit code 4 once the result is saved; ignore, which tells nothing."),
    ] = "warn",
    simplify: Annotated[
        bool,
        typer.Option("--simplify/--no-simplify", help="Pack bodies on fixed hinges as one with "
                     "what holds them, and take orientations written with 12 digits as the quarter "
                     "turns that they are."),
    ] = True,
    turns: Annotated[
        float | None,
        typer.Option("--turns", metavar="X", parser=not_negative, help="Take orientations within "
                     "so many rad of quarter turns as these (1e-11 if nothing is said; 0: none)."),
    ] = None,
    json: Json = False,
) -> None:  # fmt: skip
    """Simulate a scene and save the result; Ctrl-C keeps what was computed."""
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
    """The compiled scene, with every quantity that was asked for in it."""
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
