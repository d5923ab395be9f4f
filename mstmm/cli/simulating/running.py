"""A run that is interrupted, or whose result cannot be saved, costs nothing: it goes on later."""

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

#: A run shorter than this (s) is followed by the second one that estimates its error.
SHORT = 2.0


def run(plan: Plan, model: Model, progress: Bar) -> tuple[Result, RiskRefused | None]:
    """The result; and what --on-risk refuse says of it, if it does."""
    if plan.resume and not plan.checkpoint.is_file():
        raise MstmmError(
            f"--resume: there is no checkpoint {plan.checkpoint}; it is written when a run is "
            "interrupted, beside its --output"
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
    """The result in its place, with its error estimated where that was asked for.

    The checkpoint goes with the last step, so that every part can be done again.  A run that was
    resumed is no short one.
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
    """An interrupt beside the run itself says what there is to go on from."""
    try:
        yield
    except KeyboardInterrupt:
        if not checkpoint.is_file():
            raise
        raise Interrupted(f"interrupted; {_kept(checkpoint)}") from None


@contextmanager
def kept_if_it_fails(checkpoint: Path) -> Iterator[None]:
    """What goes wrong while a result is saved costs no run: the message says where it is kept."""
    try:
        yield
    except (MstmmError, MemoryError) as error:
        if not checkpoint.is_file():
            raise
        if isinstance(error, MstmmError):
            raise type(error)(f"{error}; {_kept(checkpoint)}") from None
        raise EnvironmentFailure(
            "there is not enough memory to evaluate all samples and to save them; "
            f"{_kept(checkpoint)} where there is more memory, or run it again with fewer --times"
        ) from None


def _kept(checkpoint: Path) -> str:
    return f"the run is kept in {checkpoint}; continue with the same command and --resume"
