"""Laws and modes so fast that an explicit method needs very many steps, where an implicit one would
cost less."""

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

#: |lambda| times the time of a run from which on it is looked at before it is made.
_MANY = 2e4

#: Parts of a run, of which the beginnings are made by an implicit method behind it.
_PARTS = 4


def applies_to(model: CompiledScene) -> bool:
    """Whether there are any."""
    return _may_be(model, 0.0)


def _may_be(model: CompiledScene, rate: float) -> bool:
    """Whether laws or shapes may move as fast as that, 1/s."""
    fast = (
        squared_frequencies(body).max(initial=0.0) > rate * rate for body in model.flexible.values()
    )
    return may_be_fast(model.scene, rate) or any(fast)


def _chooses_explicit_steps(settings: Settings) -> bool:
    """Adaptive steps of an explicit method that was asked for by name."""
    others = (AUTO, *classical_run.METHODS, *external_integrators.METHODS)
    return settings.step is None and settings.method not in others and not _implicit(settings)


def _implicit(settings: Settings) -> bool:
    return get(settings.method).implicit


# --- before ---------------------------------------------------------------------------------------


def explicit_step_count_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """That the fastest motion of the start will hold the steps back."""
    method, span = settings.method, settings.t_end - settings.t_start
    if not _chooses_explicit_steps(settings):
        return
    if not (span > 0 and _may_be(model, _MANY / span)):
        return
    try:
        rate = fastest_at_start(model.looped, settings.t_start, q, u)
    except MstmmError:  # a scene without tangent, or a start that the run itself will blame
        return
    if not rate * span > _MANY:
        return
    tableau = get(method)
    steps = rate * span / tableau.real_stability_limit
    evaluations = steps * len(tableau.B)
    ends = [(settings.t_start, q, u), (settings.t_end, q, u)]
    found = implicit_cost(model, settings, ends, evaluations)
    if found is not None:
        means = (
            f"springs, dampers or shapes move at {rate:.2g} 1/s, which holds {method} to about "
            f"{steps:.1g} steps in {span:.3g} s"
        )
        yield _stiff(means, found, evaluations, True)


# --- behind ---------------------------------------------------------------------------------------


def stability_limited_risks(model: CompiledScene, run: Trajectory) -> Iterator[Risk]:
    """That stability has set many steps of a run.  Not told of scenes with memory, whose states
    alone do not say how they go on."""
    settings, counted = run.settings, run.statistics
    if not (_chooses_explicit_steps(settings) and counted.stability_limited):
        return
    if model.packed.system.remembers or len(run.t) <= _PARTS or not np.isfinite(run.q).all():
        return
    places = np.unique(np.searchsorted(run.t, np.linspace(run.t[0], run.t[-1], _PARTS + 1)))
    states = [(float(run.t[k]), run.q[k], run.u[k]) for k in places]
    found = implicit_cost(model, settings, states, counted.evaluations)
    if found is not None:
        means = (
            f"of {counted.steps} steps {counted.stability_limited_steps} were as long as the "
            f"stability of {settings.method} allows: the scene is stiff for it"
        )
        yield _stiff(means, found, counted.evaluations, False)


def _stiff(means: str, found: ImplicitCost, evaluations: float, before: bool) -> Risk:
    return Risk(
        "stiff", RUN, means,
        f'take method = "{found.method}": by a look at some of its steps it needs about '
        f"{found.steps:.0f}, each the work of {found.each:g} evaluations, which is "
        f"{max(found.evaluations / evaluations, 0.01):.0%} of the cost",
        evaluations, found.evaluations, "evaluations", doubt=False, before=before,
    )  # fmt: skip
