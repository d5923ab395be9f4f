"""Run that can be resumed after an interrupt, or if its result cannot be saved."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from mstmm.errors import EnvironmentFailure, Interrupted, MstmmError, RiskRefused

from ..progress import Bar

if TYPE_CHECKING:
    from mstmm.runtime.model.model import Model
    from mstmm.runtime.result.result import Result

    from .plan import Plan

#: Duration (s) up to which a run is followed by a second one that estimates its error.
SHORT = 2.0


def run(plan: Plan, model: Model, progress: Bar) -> tuple[Result, RiskRefused | None]:
    """Simulate; returns the result, and the exception of --on-risk refuse, if any."""
    if plan.resume and not plan.checkpoint.is_file():
        raise MstmmError(
            f"--resume: there is no checkpoint {plan.checkpoint}; it is written to the folder of "
            "--output when a run is interrupted"
        )
    try:
        result = model.simulate(
            plan.t_end, plan.method, plan.step, plan.rtol, plan.atol,
            None if plan.times is None else plan.times.until(plan.t_end),
            max_step=plan.max_step, radius=plan.radius, scheme=plan.scheme,
            iterations=plan.iterations, tangent=plan.tangent, error=plan.error, error_of=plan.of,
            on_risk=plan.on_risk, progress=progress, resume=plan.resume,
            checkpoint=str(plan.checkpoint) if plan.resumable else None,
        )  # fmt: skip
    except RiskRefused as refused:
        if refused.result is None:
            raise
        return refused.result, refused
    return result, None


def saved(plan: Plan, result: Result, seconds: float, progress: Bar) -> Result:
    """Save the result, with an error estimate if requested, and return it.

    The checkpoint is removed in the last step, so that every part can be repeated.  A resumed run
    does not count as short.
    """
    short = seconds < SHORT and not plan.resume and plan.error is None
    if result.trajectory.is_comparable and (short if plan.certify is None else plan.certify):
        from mstmm.runtime.result.output import storage

        storage.save(result, plan.output)
        from mstmm.runtime.model.results import certified

        progress.label("estimating the error")
        result = certified(result, progress)
    result.save(plan.output)
    return result


@contextmanager
def kept_if_interrupted(checkpoint: Path) -> Iterator[None]:
    """Add the checkpoint to the message of an interrupt outside the run."""
    try:
        yield
    except KeyboardInterrupt:
        if not checkpoint.is_file():
            raise
        raise Interrupted(f"interrupted; {_kept(checkpoint)}") from None


@contextmanager
def kept_if_it_fails(checkpoint: Path) -> Iterator[None]:
    """Add the checkpoint to the message of an error that occurs while a result is saved."""
    try:
        yield
    except (MstmmError, MemoryError) as error:
        if not checkpoint.is_file():
            raise
        if isinstance(error, MstmmError):
            raise type(error)(f"{error}; {_kept(checkpoint)}") from None
        raise EnvironmentFailure(
            "not enough memory to evaluate and save all samples; "
            f"{_kept(checkpoint)} with more memory, or run it again with fewer --times"
        ) from None


def _kept(checkpoint: Path) -> str:
    return f"the run is saved in {checkpoint}; continue with the same command and --resume"
