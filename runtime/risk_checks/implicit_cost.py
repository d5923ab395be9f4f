"""Whether an implicit method would cost less than the evaluations of an explicit run.

A few steps of the implicit method, from some states of the run and with its tolerances, show how
long its steps are; what one of them costs in evaluations is known of every engine.  No clock is
looked at: the same run is told the same.
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

#: Steps of the implicit method from each state; where they do not come to the next one, those
#: after the third quarter say how many more there would be.
_TRIED, _SETTLED = 60, 45

#: An implicit step in evaluations: by the looped engine, by fused code, and where the explicit run
#: had fused code and the implicit one has none (scenes of 3 to 24 speeds).
_LOOPED, _FUSED, _APART = 30.0, 60.0, 280.0

#: So much less it has to cost.
_WORTH = 1.5


@dataclass(frozen=True)
class ImplicitCost:
    """An implicit method that would cost less: its steps, and one of them in evaluations."""

    method: str
    steps: float
    each: float

    @property
    def evaluations(self) -> float:
        """All of its work, in evaluations."""
        return self.steps * self.each


def implicit_cost(
    model: CompiledScene,
    settings: Settings,
    states: Sequence[tuple[float, Array, Array]],
    evaluations: float,
) -> ImplicitCost | None:
    """The method that would make a run through these states (t, q, u), up to the last of them, of
    so many evaluations, at less cost; None where it would not, or where that is not known."""
    steps, ends = 0.0, [t for t, _, _ in states[1:]]
    for (t, q, u), end in zip(states, ends, strict=False):
        count = _steps(model, settings, t, end, q, u)
        if count is None:
            return None
        steps += count
    found = ImplicitCost(implicit_method(settings.rtol), steps, _each(model))
    return found if _WORTH * found.evaluations < evaluations else None


def _steps(
    model: CompiledScene, settings: Settings, t: float, end: float, q: Array, u: Array
) -> float | None:
    """Implicit steps from a state to a time; None where there are none."""
    method = implicit_method(settings.rtol)
    tried = replace(
        settings, t_start=t, t_end=end, method=method, output_times=None, max_steps=_TRIED,
        tangent="auto",
    )  # fmt: skip
    try:
        run = first_run(model, tried, q, u, RunMonitor(None, tried))
    except MstmmError:  # a scene without tangent
        return None
    made = len(run.t) - 1
    if run.success:
        return float(made)
    if made <= _SETTLED:
        return None
    pace = (run.t[-1] - run.t[_SETTLED]) / (made - _SETTLED)
    return float(made + (end - run.t[-1]) / pace)


def _each(model: CompiledScene) -> float:
    fusion = model.fusion
    if fusion.library is None:
        return _LOOPED
    return _APART if fusion.implicit is None else _FUSED
