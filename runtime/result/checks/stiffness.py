"""Stiff scenes: an explicit method is limited by stability, and an implicit one costs less.

Trial steps of the implicit method from some states of the run, with its tolerances, give the step
size; the cost of a step in evaluations is a constant of each engine.  No time is measured, so that
the finding is reproducible.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError
from mstmm.risk import RUN, Risk

from ...integrate.steppers import AUTO, get
from ...run import classical_run, external_integrators
from ...run.method_switching import implicit_method
from ...run.run_execution import RunMonitor, first_run
from ...run.spectral_radius import fastest_at_start, fastest_possible
from .check import Check, RunStart
from .flexible import squared_frequencies

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...integrate.settings import Settings
    from ...run.trajectory import Trajectory

#: |lambda| times the duration of a run from which on it is checked before it starts.
_MIN_ROTATION = 2e4

#: Number of states of a finished run from which the implicit method is tried.
_TRIALS = 4

#: Trial steps from each state.  If they do not reach the next state, the number of further steps is
#: extrapolated from those after the first 45.
_TRIAL_STEPS, _TRANSIENT_STEPS = 60, 45

#: Cost of an implicit step in evaluations: looped engine, fused code, and fused code without
#: implicit kernels (scenes of 3 to 24 speeds).
_LOOPED, _FUSED, _FUSED_EXPLICIT_ONLY = 30.0, 60.0, 280.0

#: Smallest reported ratio of explicit to implicit cost.
_MIN_GAIN = 1.5


class StiffnessCheck(Check):
    """Explicit steps that stability limits where an implicit method costs less."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risk that the fastest motion at the start limits the steps of the run."""
        model, settings = start.model, start.settings
        method, span = settings.method, settings.t_end - settings.t_start
        if not (span > 0 and _is_adaptive_explicit(settings)):
            return
        if not _may_be_fast(model, _MIN_ROTATION / span):
            return
        try:
            rate = fastest_at_start(model.looped, settings.t_start, start.q, start.u)
        except MstmmError:  # a scene without tangent, or an invalid start, which the run reports
            return
        if not rate * span > _MIN_ROTATION:
            return
        tableau = get(method)
        steps = rate * span / tableau.real_stability_limit
        evaluations = steps * len(tableau.B)
        ends = [(t, start.q, start.u) for t in (settings.t_start, settings.t_end)]
        cost = implicit_cost(model, settings, ends, evaluations)
        if cost is not None:
            means = (
                f"springs, dampers or shapes move at {rate:.2g} 1/s, which limits {method} to "
                f"about {steps:.1g} steps in {span:.3g} s"
            )
            yield _stiff_risk(means, cost, evaluations, True)

    def after_steps(self, model: CompiledScene, run: Trajectory) -> Iterator[Risk]:
        """Risk that stability has limited many steps of a run.

        Scenes with memory are not checked, because a run cannot restart from their states alone.
        """
        settings, statistics = run.settings, run.statistics
        if not (_is_adaptive_explicit(settings) and statistics.stability_limited):
            return
        is_restartable = not model.packed_scene.system.uses_memory and np.isfinite(run.q).all()
        if not is_restartable or len(run.t) <= _TRIALS:
            return
        indices = np.unique(np.searchsorted(run.t, np.linspace(run.t[0], run.t[-1], _TRIALS + 1)))
        states = [(float(run.t[k]), run.q[k], run.u[k]) for k in indices]
        cost = implicit_cost(model, settings, states, statistics.evaluations)
        if cost is not None:
            means = (
                f"stability of {settings.method} limited {statistics.stability_limited_steps} of "
                f"{statistics.steps} steps: the scene is stiff for this method"
            )
            yield _stiff_risk(means, cost, statistics.evaluations, False)


STIFFNESS = StiffnessCheck()


def _may_be_fast(model: CompiledScene, rate: float) -> bool:
    """Whether laws or shapes may move faster than a rate, 1/s."""
    fast = (
        squared_frequencies(body).max(initial=0.0) > rate * rate
        for body in model.flexible_bodies.values()
    )
    return fastest_possible(model.scene) > rate or any(fast)


def _is_adaptive_explicit(settings: Settings) -> bool:
    """Whether a run has adaptive steps of an explicit method that was requested by name."""
    others = (AUTO, *classical_run.METHODS, *external_integrators.METHODS)
    if settings.step is not None or settings.method in others:
        return False
    return not get(settings.method).implicit


def _stiff_risk(means: str, cost: ImplicitCost, evaluations: float, before: bool) -> Risk:
    return Risk(
        "stiff", RUN, means,
        f'use method = "{cost.method}": according to trial steps it needs about '
        f"{cost.steps:.0f} steps of {cost.evaluations_per_step:g} evaluations each, "
        f"{max(cost.evaluations / evaluations, 0.01):.0%} of the cost",
        evaluations, cost.evaluations, "evaluations", invalidates=False, seen_before_run=before,
    )  # fmt: skip


# --- cost of the implicit method ------------------------------------------------------------------


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
