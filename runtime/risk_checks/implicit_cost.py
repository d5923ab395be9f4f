"""Cost of an implicit method compared with the evaluations of an explicit run.

Trial steps of the implicit method from some states of the run, with its tolerances, give the step
size; the cost of a step in evaluations is a constant of each engine.  No time is measured, so that
the finding is reproducible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.errors import MstmmError

from ..run.method_switching import implicit_method
from ..run.run_execution import RunMonitor, first_run

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings

#: Trial steps from each state.  If they do not reach the next state, the number of further steps is
#: extrapolated from those after the first 45.
_TRIAL_STEPS, _TRANSIENT_STEPS = 60, 45

#: Cost of an implicit step in evaluations: looped engine, fused code, and fused code without
#: implicit kernels (scenes of 3 to 24 speeds).
_LOOPED, _FUSED, _FUSED_EXPLICIT_ONLY = 30.0, 60.0, 280.0

#: Smallest reported ratio of explicit to implicit cost.
_MIN_GAIN = 1.5


@dataclass(frozen=True)
class ImplicitCost:
    """Implicit method of lower cost: number of its steps, and evaluations per step."""

    method: str
    steps: float
    evaluations_per_step: float

    @property
    def evaluations(self) -> float:
        """Total cost in evaluations."""
        return self.steps * self.evaluations_per_step


def implicit_cost(
    model: CompiledScene,
    settings: Settings,
    states: Sequence[tuple[float, Array, Array]],
    evaluations: float,
) -> ImplicitCost | None:
    """Implicit method that costs less than a run of `evaluations` through some states (t, q, u).

    None if it does not, or if its cost is unknown.
    """
    steps, ends = 0.0, [t for t, _, _ in states[1:]]
    for (t, q, u), end in zip(states, ends, strict=False):
        count = _step_count(model, settings, t, end, q, u)
        if count is None:
            return None
        steps += count
    cost = ImplicitCost(implicit_method(settings.rtol), steps, _evaluations_per_step(model))
    return cost if _MIN_GAIN * cost.evaluations < evaluations else None


def _step_count(
    model: CompiledScene, settings: Settings, t: float, end: float, q: Array, u: Array
) -> float | None:
    """Estimated number of implicit steps from a state to a time; None if it is unknown."""
    method = implicit_method(settings.rtol)
    trial = replace(
        settings, t_start=t, t_end=end, method=method, output_times=None, max_steps=_TRIAL_STEPS,
        tangent="auto",
    )  # fmt: skip
    try:
        run = first_run(model, trial, q, u, RunMonitor(None, trial))
    except MstmmError:  # a scene without tangent
        return None
    count = len(run.t) - 1
    if run.success:
        return float(count)
    if count <= _TRANSIENT_STEPS:
        return None
    mean_step = (run.t[-1] - run.t[_TRANSIENT_STEPS]) / (count - _TRANSIENT_STEPS)
    return float(count + (end - run.t[-1]) / mean_step)


def _evaluations_per_step(model: CompiledScene) -> float:
    fusion = model.fusion
    if fusion.library is None:
        return _LOOPED
    return _FUSED_EXPLICIT_ONLY if fusion.implicit is None else _FUSED
