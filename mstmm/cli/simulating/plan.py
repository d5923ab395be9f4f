"""What a run was asked for, checked."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mstmm.defaults import METHOD
from mstmm.errors import MstmmError

from ..models import OF_OTHERS
from ..options import Times

#: Most fixed steps of a run.
MAX_STEPS = 1e11

#: How the names of the classical discrete-time method begin.
_CLASSICAL = "dttmm-classical"


@dataclass(frozen=True)
class Plan:
    """What was asked for, checked."""

    scene: str
    t_end: float
    method: str | None
    step: float | None
    rtol: float | None
    atol: float | None
    times: Times | None
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
        """Integrators of others, the classical method and runs for an error keep no checkpoints."""
        others = (self.method or METHOD).startswith((*OF_OTHERS, _CLASSICAL))
        return self.error is None and not others

    @property
    def checkpoint(self) -> Path:
        """Where an interrupted run keeps its state."""
        return self.output.with_name(self.output.name + ".checkpoint")


def refuse_endless(plan: Plan) -> None:
    """A step so small that no machine would ever reach the end."""
    if plan.step is not None and plan.t_end / plan.step > MAX_STEPS:
        raise MstmmError(
            f"--step {plan.step:g}: {plan.t_end / plan.step:.1e} steps would never end; "
            f"take {plan.t_end / MAX_STEPS:.1e} s or more"
        )


def refuse_beside_error(plan: Plan) -> None:
    """Several runs are made for an error, of which none is kept to go on from; and what is trusted
    is what was asked for."""
    if plan.error is not None and plan.resume:
        raise MstmmError(
            "--resume: there is no checkpoint of runs with --error; run it again, or take the "
            "method and the tolerances that such a run has found"
        )
    if plan.error is not None and plan.accuracy is not None:
        raise MstmmError(
            "--accuracy beside --error: a result counts as trusted that reaches --error; leave "
            "--accuracy out"
        )
