"""`mstmm simulate`: run a scene, save the result and report whether it can be trusted."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mstmm.defaults import ATOL, METHOD, RTOL
from mstmm.errors import NumericalFailure, SceneError

from ..extra_checks import require_extra_for, result_ending
from ..graphics.plot import PLOT_ENDINGS, RESULT_ENDINGS
from ..model_loading import compile_file, generate_elements, load_method
from ..options import (
    Elements,
    Json,
    OutputTimes,
    output_file,
    parse_not_negative,
    parse_positive,
    parse_times,
    with_inputs,
)
from ..progress import progress_bar
from .resumable_run import (
    keep_checkpoint_on_error,
    keep_checkpoint_on_interrupt,
    save_result,
    simulate_plan,
)
from .run_options import RunOptions, require_feasible_step, require_options_of_error
from .run_output import print_risks, report_run, was_interrupted

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model


def simulate(
    scene: Annotated[str, typer.Argument(metavar="SCENE", help="Scene file, .toml or .json.")],
    t_end: Annotated[
        float, typer.Option("--t-end", metavar="S", parser=parse_positive, help="End time, s.")
    ] = 10.0,
    method: Annotated[
        str | None,
        typer.Option(
            "--method",
            metavar="NAME",
            show_default=f"auto, {METHOD} with --step",
            help="Integration method, see `mstmm list methods`; auto chooses one.",
        ),
    ] = None,
    step: Annotated[
        float | None,
        typer.Option(
            "--step",
            metavar="S",
            parser=parse_positive,
            help="Fixed time step, s; required by fixed-step methods.",
        ),
    ] = None,
    rtol: Annotated[
        float | None,
        typer.Option(
            "--rtol",
            metavar="X",
            parser=parse_positive,
            show_default=f"{RTOL:g}",
            help="Relative tolerance.",
        ),
    ] = None,
    atol: Annotated[
        float | None,
        typer.Option(
            "--atol",
            metavar="X",
            parser=parse_not_negative,
            show_default=f"{ATOL:g}",
            help="Absolute tolerance.",
        ),
    ] = None,
    error: Annotated[
        float | None,
        typer.Option(
            "--error",
            metavar="X",
            parser=parse_positive,
            help="Target error of the whole run, "
            "in place of tolerances: rad, or relative to the motion; several runs may be "
            "made.",
        ),
    ] = None,
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            metavar="NAME",
            help="Quantity to which --error applies, in its unit, "
            "such as rod1.tip.position; repeatable.",
        ),
    ] = None,
    max_step: Annotated[
        float | None,
        typer.Option(
            "--max-step",
            metavar="S",
            parser=parse_positive,
            help="Maximum time step of adaptive methods, s; use it when a force is narrow.",
        ),
    ] = None,
    radius: Annotated[
        float | None,
        typer.Option(
            "--radius",
            metavar="X",
            parser=parse_not_negative,
            help="Spectral radius at infinity of genalpha and dttmm, 0 to 1 (0.8).",
        ),
    ] = None,
    times: Annotated[
        OutputTimes | None,
        typer.Option(
            "--times",
            metavar="N|DT",
            parser=parse_times,
            help="Output times: a count (201) or an interval in s (0.05, 1s); default: every step.",
        ),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="Result file: .nc, .csv or .mat; default: scene name, current folder.",
        ),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="Plot file: .png, .svg or .pdf."),
    ] = None,
    quantity: Annotated[
        list[str] | None,
        typer.Option(
            "--quantity",
            "-q",
            metavar="NAME",
            help="Quantity to plot and print, such as "
            "shoulder.angle, rod1.tip.position, energy; repeatable.",
        ),
    ] = None,
    inputs: Annotated[
        list[str] | None,
        typer.Option(
            "--input",
            metavar="NAME=VALUE",
            help="Value of a scene input, or the name of a signal; repeatable.",
        ),
    ] = None,
    hinge: Elements = None,
    certify: Annotated[
        bool | None,
        typer.Option(
            "--certify/--no-certify",
            help="Estimate the error with a second, more accurate run; default: after short runs.",
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Continue an interrupted run, with the same options.")
    ] = False,
    sweep: Annotated[
        str,
        typer.Option(
            "--sweep",
            metavar="NAME",
            help="Sweep: riccati; refined or qr for large mass "
            "ratios; product (plain product, chains only); auto: the first that is "
            "accurate enough at the start.",
        ),
    ] = "auto",
    engine: Annotated[
        str,
        typer.Option(
            "--engine",
            metavar="NAME",
            help="auto, looped (generic C loop) or fused (C compiled for this scene).",
        ),
    ] = "auto",
    flexibility: Annotated[
        str | None,
        typer.Option(
            "--flexibility",
            metavar="LEVEL",
            help="Model level of all flexible bodies: "
            "coupled, one-way or rigid; default: as in the scene.",
        ),
    ] = None,
    scheme: Annotated[
        str,
        typer.Option(
            "--scheme",
            metavar="NAME",
            help="Time scheme of dttmm-classical: "
            "generalised-alpha, hht, newmark, wilson; parameter as in hht:0.3.",
        ),
    ] = "",
    iterations: Annotated[
        int,
        typer.Option(
            "--iterations",
            metavar="N",
            help="Maximum Newton iterations per step of dttmm-classical.",
        ),
    ] = 1,
    tangent: Annotated[
        str,
        typer.Option(
            "--tangent",
            metavar="NAME",
            help="Tangent matrix of implicit methods: exact, laws (hinge laws only) or auto.",
        ),
    ] = "auto",
    accuracy: Annotated[
        float | None,
        typer.Option(
            "--accuracy",
            metavar="X",
            parser=parse_positive,
            help="Largest estimated error of "
            "a trusted result: rad, or relative to the motion (0.01).",
        ),
    ] = None,
    on_risk: Annotated[
        str,
        typer.Option(
            "--on-risk",
            metavar="ACTION",
            help="Action if the result is in doubt: warn; "
            "refuse (before the run, else exit code 4 after saving); ignore.",
        ),
    ] = "warn",
    simplify: Annotated[
        bool,
        typer.Option(
            "--simplify/--no-simplify",
            help="Merge bodies on fixed hinges, and snap nearly right angles to exact ones.",
        ),
    ] = True,
    turns: Annotated[
        float | None,
        typer.Option(
            "--turns",
            metavar="X",
            parser=parse_not_negative,
            help="Tolerance for snapping to right angles, rad (1e-11; 0 switches it off).",
        ),
    ] = None,
    json: Json = False,
) -> None:
    """Simulate a scene and save the result; Ctrl-C saves what has been computed."""
    plan = RunOptions(
        scene, t_end, method, step, rtol, atol, times,
        output_file(_default_output(scene) if output is None else output, RESULT_ENDINGS),
        None if plot is None else output_file(plot, PLOT_ENDINGS, "--plot"),
        tuple(quantity or ()), certify, resume, sweep, engine, flexibility, accuracy,
        max_step or 0.0, radius, scheme, iterations, tangent, error, tuple(of or ()),
        on_risk, tuple(inputs or ()), simplify, turns,
    )  # fmt: skip
    require_feasible_step(plan)
    require_options_of_error(plan)

    require_extra_for(plan.output, "--output")
    if plan.plot is not None:
        require_extra_for(plan.plot, "--plot")
    generate_elements(hinge or [])
    model = _compile_model(plan)
    load_method(plan.method or METHOD)
    with progress_bar() as progress, keep_checkpoint_on_interrupt(plan.checkpoint):
        start_time = time.perf_counter()
        result, rejection = simulate_plan(plan, model, progress)
        seconds = time.perf_counter() - start_time
        with keep_checkpoint_on_error(plan.checkpoint):
            result = save_result(plan, result, seconds, progress)
    if plan.plot is not None:
        result.plot(*plan.quantities, path=plan.plot, title=Path(plan.scene).stem)
    report_run(plan, result, seconds + result.trajectory.earlier_seconds, json, rejection)
    if was_interrupted(result):
        raise typer.Exit(130)
    if not result.success:
        raise typer.Exit(NumericalFailure.exit_code)
    if rejection is not None:
        raise typer.Exit(print_risks(plan, rejection))


def _default_output(scene: str) -> str:
    stem = Path(scene).stem or "result"
    return stem + result_ending()


def _compile_model(plan: RunOptions) -> Model:
    """Compile the scene, and check that it has all requested quantities."""
    import mstmm
    from mstmm.scene.validators.validation_messages import did_you_mean

    scene, level = mstmm.load_scene(plan.scene), plan.flexibility
    if plan.inputs:
        scene = with_inputs(scene, plan.inputs)
    turns = plan.simplify if plan.turns is None else plan.turns
    simplifications = {"welds": plan.simplify, "turns": turns, "links": plan.simplify}
    model = compile_file(plan.scene, scene, plan.sweep, plan.engine, level, simplifications)
    if plan.quantities:
        start_result = model.simulate(t_end=0.0, method="dop853")
        pictures = start_result.picture_names()
        for name in plan.quantities:
            try:
                if name not in pictures:
                    start_result.quantity(name)
            except SceneError as error:
                hint = did_you_mean(name, pictures)
                has_suggestion = "did you mean" in hint
                text = (
                    f'"{name}": there is no such quantity or picture{hint}'
                    if has_suggestion
                    else error
                )
                raise SceneError(f"--quantity {text}") from None
    return model
