"""Risks that are seen before a run: in its scene, its settings, and its start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mstmm.arrays import Array
from mstmm.risk import Risk

from ..run.notes import foreseen
from ..run.stability import StepCheck, check_step
from . import fast, heavy, locked, shapes, spun

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..integrate.settings import Settings
    from ..run.trajectory import Trajectory


@dataclass(frozen=True)
class Start:
    """What is known of a run at its start: the fixed step against the fastest motion, and risks;
    whether its user wants to be told of those."""

    step: StepCheck | None
    risks: tuple[Risk, ...]
    told: bool = True

    def given(self, run: Trajectory) -> Trajectory:
        """The run with what was known of it."""
        return replace(run, risks=(*self.risks, *run.risks), told=self.told)


def look(model: Compiled, settings: Settings, q: Array, u: Array) -> Start:
    """Look at a run from (nq,), (nu,) before it is made.

    Raises SceneError for settings that no run can have.
    """
    step = check_step(model.looped, settings, q, u)
    own = () if step is None or step.risk is None else (step.risk,)
    guards = (
        heavy.lost_digits, locked.near_lock, spun.linear_bodies, shapes.too_few, fast.many_steps,
    )  # fmt: skip
    found = (risk for guard in guards for risk in guard(model, settings, q, u))
    return Start(step, (*own, *foreseen(model.packed, settings), *found))
