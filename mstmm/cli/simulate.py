"""`mstmm simulate`: run a scene, save the result and report whether it can be trusted."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mstmm.defaults import METHOD
from mstmm.errors import (
    EnvironmentFailure,
    Interrupted,
    MstmmError,
    NumericalFailure,
    RiskRefused,
    SceneError,
)

from . import run_summary
from .model_loading import compile_file, generate_elements, load_method
from .options import require_extra_for, with_inputs
from .progress import ProgressBar, progress_bar
from .run_options import MethodOptions, RunOptions
from .terminal_output import print_error, print_json, print_lines, table_console

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.runtime.result.certificate import Verdict
    from mstmm.runtime.result.result import Result

#: Duration (s) up to which a run is followed by a second one that estimates its error.
MAX_SHORT_RUN = 2.0

#: Number of rows of the table on the terminal.
_TABLE_ROWS = 9


def simulate(plan: RunOptions, method: Annotated[Any, MethodOptions]) -> None:
    """Simulate a scene and save the result; Ctrl-C saves what has been computed."""
    given = {name: value for name, value in vars(method).items() if value is not None}
    plan = replace(plan, method_options=given)
    plan.check()
    require_extra_for(plan.result_file, "--output")
    if plan.plot_file is not None:
        require_extra_for(plan.plot_file, "--plot")
    generate_elements(plan.hinge or [])
    model = _compile_model(plan)
    load_method(plan.method or METHOD)
    with progress_bar() as progress, _keep_checkpoint_on_interrupt(plan.checkpoint):
        start_time = time.perf_counter()
        result, rejection = _simulate_plan(plan, model, progress)
        seconds = time.perf_counter() - start_time
        with _keep_checkpoint_on_error(plan.checkpoint):
            result = _save_result(plan, result, seconds, progress)
    if plan.plot_file is not None:
        result.plot(*(plan.quantity or ()), path=plan.plot_file, title=Path(plan.scene).stem)
    _report_run(plan, result, seconds + result.trajectory.earlier_seconds, rejection)
    if _was_interrupted(result):
        raise typer.Exit(130)
    if not result.success:
        raise typer.Exit(NumericalFailure.exit_code)
    if rejection is not None:
        print_error(f"{plan.scene}: {rejection}\nthe result is in {plan.result_file}")
        raise typer.Exit(rejection.exit_code)


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
    if plan.quantity:
        start_result = model.simulate(t_end=0.0, method="dop853")
        pictures = start_result.picture_names()
        for name in plan.quantity:
            try:
                if name not in pictures:
                    start_result.quantity(name)
            except SceneError as error:
                hint, text = did_you_mean(name, pictures), str(error)
                if "did you mean" in hint:
                    text = f'"{name}": there is no such quantity or picture{hint}'
                raise SceneError(f"--quantity {text}") from None
    return model


# --- run, which can be resumed after an interrupt, or if its result cannot be saved ---------------


def _simulate_plan(
    plan: RunOptions, model: Model, progress: ProgressBar
) -> tuple[Result, RiskRefused | None]:
    """Simulate; returns the result, and the exception of --on-risk refuse, if any."""
    from mstmm.runtime.experiments.run_request import Execution

    if plan.resume and not plan.checkpoint.is_file():
        raise MstmmError(
            f"--resume: there is no checkpoint {plan.checkpoint}; it is written to the folder of "
            "--output when a run is interrupted"
        )
    try:
        result = model.simulate(
            plan.t_end, plan.method_object, plan.step, plan.rtol, plan.atol,
            None if plan.times is None else plan.times.until(plan.t_end),
            error=plan.target_error,
            execution=Execution(
                plan.on_risk, progress, plan.checkpoint if plan.resumable else None, plan.resume
            ),
        )  # fmt: skip
    except RiskRefused as rejection:
        if rejection.result is None:
            raise
        return rejection.result, rejection
    return result, None


def _save_result(plan: RunOptions, result: Result, seconds: float, progress: ProgressBar) -> Result:
    """Save the result, with an error estimate if requested, and return it.

    The checkpoint is removed in the last step, so that every part can be repeated.  A resumed run
    does not count as short.
    """
    is_short = seconds < MAX_SHORT_RUN and not plan.resume and plan.error is None
    if result.trajectory.is_comparable and (is_short if plan.certify is None else plan.certify):
        from mstmm.runtime.result.export import xarray_dataset

        xarray_dataset.save_result(result, plan.result_file)
        from mstmm.runtime.experiments.run_results import certify_result

        progress.label("estimating the error")
        result = certify_result(result, progress)
    result.save(plan.result_file)
    return result


@contextmanager
def _keep_checkpoint_on_interrupt(checkpoint: Path) -> Iterator[None]:
    """Add the checkpoint to the message of an interrupt outside the run."""
    try:
        yield
    except KeyboardInterrupt:
        if not checkpoint.is_file():
            raise
        raise Interrupted(f"interrupted; {_checkpoint_message(checkpoint)}") from None


@contextmanager
def _keep_checkpoint_on_error(checkpoint: Path) -> Iterator[None]:
    """Add the checkpoint to the message of an error that occurs while a result is saved."""
    try:
        yield
    except (MstmmError, MemoryError) as error:
        if not checkpoint.is_file():
            raise
        if isinstance(error, MstmmError):
            raise type(error)(f"{error}; {_checkpoint_message(checkpoint)}") from None
        raise EnvironmentFailure(
            "not enough memory to evaluate and save all samples; "
            f"{_checkpoint_message(checkpoint)} with more memory, or run it again with fewer "
            f"--times"
        ) from None


def _checkpoint_message(checkpoint: Path) -> str:
    return f"the run is saved in {checkpoint}; continue with the same command and --resume"


# --- output ---------------------------------------------------------------------------------------


def _was_interrupted(result: Result) -> bool:
    """Whether Ctrl-C or SIGTERM ended the run."""
    return result.status is None


def _report_run(
    plan: RunOptions, result: Result, seconds: float, refused: RiskRefused | None
) -> None:
    """Report a run on the terminal or as JSON."""
    files_written = [str(path) for path in (plan.result_file, plan.plot_file) if path is not None]
    if plan.json:
        data = run_summary.to_json(result, seconds, _plan_verdict(plan, result))
        data |= {"scene": plan.scene, "files": files_written}
        if refused is not None:
            data["error"] = {
                "type": type(refused).__name__, "message": str(refused),
                "exit_code": refused.exit_code,
            }  # fmt: skip
        if _was_interrupted(result) and plan.resumable:
            data["checkpoint"] = str(plan.checkpoint)
        print_json(data)
    else:
        _print_report(plan, result, seconds, files_written)
    if _was_interrupted(result) and plan.resumable:
        print_error(f"{result.message}; continue with the same command and --resume")
    elif _was_interrupted(result):
        print_error(f"{result.message}; the result so far is in {plan.result_file}")
    elif not result.success:
        print_error(f"{plan.scene}: {result.message}; the result so far is in {plan.result_file}")


def _plan_verdict(plan: RunOptions, result: Result) -> Verdict:
    certificate = result.certificate
    return certificate.verdict() if plan.accuracy is None else certificate.verdict(plan.accuracy)


def _print_report(plan: RunOptions, result: Result, seconds: float, made: list[str]) -> None:
    console = table_console()
    verdict, has_reasons = _plan_verdict(plan, result), result.trajectory.reported_risks
    for line in run_summary.verdict_lines(verdict, console.width, has_reasons):
        print_lines(line)
    print_lines(f"{plan.scene}: {run_summary.size_text(result)}, {run_summary.engine_text(result)}")
    print_lines(run_summary.effort_text(result, seconds))
    if simplifications := run_summary.simplification_counts(result):
        print_lines(f"  {simplifications}")
    for line in run_summary.method_lines(result, console.width):
        print_lines(line)
    print_lines(result.message)
    if len(result.t):
        print_lines()
        print_lines(
            run_summary.fitting_table(
                result, tuple(plan.quantity or ()), _TABLE_ROWS, console.width
            )
        )
    print_lines()
    for line in run_summary.certificate_lines(result, console.width):
        print_lines(line)
    print_lines()
    print_lines(f"wrote {' and '.join(made)} ({run_summary.count_text(len(result.t), 'sample')})")
