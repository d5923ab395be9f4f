"""Run that can be resumed after an interrupt, or if its result cannot be saved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mstmm.errors import EnvironmentFailure, Interrupted, MstmmError, RiskRefused
from mstmm.runtime.model.execution import Execution

from ..progress import ProgressBar

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.runtime.result.result import Result

    from .run_options import RunOptions

#: Duration (s) up to which a run is followed by a second one that estimates its error.
MAX_SHORT_RUN = 2.0


def simulate_plan(
    plan: RunOptions, model: Model, progress: ProgressBar
) -> tuple[Result, RiskRefused | None]:
    """Simulate; returns the result, and the exception of --on-risk refuse, if any."""
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


def save_result(plan: RunOptions, result: Result, seconds: float, progress: ProgressBar) -> Result:
    """Save the result, with an error estimate if requested, and return it.

    The checkpoint is removed in the last step, so that every part can be repeated.  A resumed run
    does not count as short.
    """
    is_short = seconds < MAX_SHORT_RUN and not plan.resume and plan.error is None
    if result.trajectory.is_comparable and (is_short if plan.certify is None else plan.certify):
        from mstmm.runtime.result.export import result_files

        result_files.save_result(result, plan.result_file)
        from mstmm.runtime.model.run_results import certify_result

        progress.label("estimating the error")
        result = certify_result(result, progress)
    result.save(plan.result_file)
    return result


@contextmanager
def keep_checkpoint_on_interrupt(checkpoint: Path) -> Iterator[None]:
    """Add the checkpoint to the message of an interrupt outside the run."""
    try:
        yield
    except KeyboardInterrupt:
        if not checkpoint.is_file():
            raise
        raise Interrupted(f"interrupted; {_checkpoint_message(checkpoint)}") from None


@contextmanager
def keep_checkpoint_on_error(checkpoint: Path) -> Iterator[None]:
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
