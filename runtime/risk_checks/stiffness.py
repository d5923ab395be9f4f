"""Stiff scenes: an explicit method is limited by stability, and an implicit one costs less."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError
from mstmm.risk import RUN, Risk

from ..integrate.steppers import AUTO, get
from ..run import classical_run, external_integrators
from ..run.spectral_radius import fastest_at_start, may_be_fast
from .excitation_bandwidth import squared_frequencies
from .implicit_cost import ImplicitCost, implicit_cost

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings
    from ..run.trajectory import Trajectory

#: |lambda| times the duration of a run from which on it is checked before it starts.
_MIN_ROTATION = 2e4

#: Number of states of a finished run from which the implicit method is tried.
_TRIALS = 4


def applies_to(model: CompiledScene) -> bool:
    """Whether there are laws or shapes that may be stiff."""
    return _may_be_fast(model, 0.0)


def _may_be_fast(model: CompiledScene, rate: float) -> bool:
    """Whether laws or shapes may move faster than a rate, 1/s."""
    fast = (
        squared_frequencies(body).max(initial=0.0) > rate * rate
        for body in model.flexible_bodies.values()
    )
    return may_be_fast(model.scene, rate) or any(fast)


def _is_adaptive_explicit(settings: Settings) -> bool:
    """Whether a run has adaptive steps of an explicit method that was requested by name."""
    others = (AUTO, *classical_run.METHODS, *external_integrators.METHODS)
    if settings.step is not None or settings.method in others:
        return False
    return not get(settings.method).implicit


# --- before a run ---------------------------------------------------------------------------------


def explicit_step_count_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """Risk that the fastest motion at the start limits the steps of the run."""
    method, span = settings.method, settings.t_end - settings.t_start
    if not _is_adaptive_explicit(settings):
        return
    if not (span > 0 and _may_be_fast(model, _MIN_ROTATION / span)):
        return
    try:
        rate = fastest_at_start(model.looped, settings.t_start, q, u)
    except MstmmError:  # a scene without tangent, or an invalid start, which the run reports
        return
    if not rate * span > _MIN_ROTATION:
        return
    tableau = get(method)
    steps = rate * span / tableau.real_stability_limit
    evaluations = steps * len(tableau.B)
    ends = [(settings.t_start, q, u), (settings.t_end, q, u)]
    cost = implicit_cost(model, settings, ends, evaluations)
    if cost is not None:
        means = (
            f"springs, dampers or shapes move at {rate:.2g} 1/s, which limits {method} to about "
            f"{steps:.1g} steps in {span:.3g} s"
        )
        yield _stiff_risk(means, cost, evaluations, True)


# --- after a run ----------------------------------------------------------------------------------


def stability_limited_risks(model: CompiledScene, run: Trajectory) -> Iterator[Risk]:
    """Risk that stability has limited many steps of a run.

    Scenes with memory are not checked, because a run cannot restart from their states alone.
    """
    settings, statistics = run.settings, run.statistics
    if not (_is_adaptive_explicit(settings) and statistics.stability_limited):
        return
    if (
        model.packed_scene.system.uses_memory
        or len(run.t) <= _TRIALS
        or not np.isfinite(run.q).all()
    ):
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


def _stiff_risk(means: str, cost: ImplicitCost, evaluations: float, before: bool) -> Risk:
    return Risk(
        "stiff", RUN, means,
        f'use method = "{cost.method}": according to trial steps it needs about '
        f"{cost.steps:.0f} steps of {cost.evaluations_per_step:g} evaluations each, "
        f"{max(cost.evaluations / evaluations, 0.01):.0%} of the cost",
        evaluations, cost.evaluations, "evaluations", invalidates=False, seen_before_run=before,
    )  # fmt: skip
