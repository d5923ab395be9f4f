"""Checked options of `mstmm simulate`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mstmm.defaults import METHOD
from mstmm.errors import MstmmError

from ..model_loading import EXTERNAL_PREFIXES
from ..options import OutputTimes

#: Largest number of fixed steps of a run.
MAX_STEPS = 1e11

#: Prefix of the names of the classical discrete-time method.
_CLASSICAL_PREFIX = "dttmm-classical"


@dataclass(frozen=True)
class RunOptions:
    """Options of a run, checked."""

    scene: str
    t_end: float
    method: str | None
    step: float | None
    rtol: float | None
    atol: float | None
    times: OutputTimes | None
    output: Path
    plot: Path | None
    quantities: tuple[str, ...]
    certify: bool | None
    resume: bool
    sweep: str = "auto"
    engine: str = "auto"
    flexibility: str | None = None
    accuracy: float | None = None
    max_step: float = 0.0
    radius: float | None = None
    scheme: str = ""
    iterations: int = 1
    tangent: str = "auto"
    error: float | None = None
    of: tuple[str, ...] = ()
    on_risk: str = "warn"
    inputs: tuple[str, ...] = ()
    simplify: bool = True
    turns: float | None = None

    @property
    def resumable(self) -> bool:
        """Whether the run writes checkpoints.

        External integrators, the classical method and runs for a target error do not.
        """
        is_external = (self.method or METHOD).startswith((*EXTERNAL_PREFIXES, _CLASSICAL_PREFIX))
        return self.error is None and not is_external

    @property
    def checkpoint(self) -> Path:
        """File in which an interrupted run saves its state."""
        return self.output.with_name(self.output.name + ".checkpoint")


def require_feasible_step(plan: RunOptions) -> None:
    """Reject a step so small that the run would never end."""
    if plan.step is not None and plan.t_end / plan.step > MAX_STEPS:
        raise MstmmError(
            f"--step {plan.step:g}: {plan.t_end / plan.step:.1e} steps would never end; "
            f"use {plan.t_end / MAX_STEPS:.1e} s or more"
        )


def require_options_of_error(plan: RunOptions) -> None:
    """Reject options that contradict --error.

    The several runs for a target error write no checkpoint, and the target error is the accuracy.
    """
    if plan.error is not None and plan.resume:
        raise MstmmError(
            "--resume: runs with --error write no checkpoint; run it again, or use the method and "
            "the tolerances found by such a run"
        )
    if plan.error is not None and plan.accuracy is not None:
        raise MstmmError(
            "--accuracy with --error: a result is trusted if it reaches --error; leave out "
            "--accuracy"
        )
