"""A run whose guard is judged: what it said before and behind it, and how wrong it really is."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

import mstmm
from mstmm.risk import Risk
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result.error_measure import Coordinates
from mstmm.runtime.result.result import Result
from mstmm.runtime.risk_checks.pre_run import check_before_run

Scene = dict[str, Any]


@dataclass(frozen=True)
class Trial:
    """What came out of one.

    Attributes:
        drawn: the number that was drawn on both sides of where the method fails.
        before, after: names of the risks that were told before the run, and behind it.
        error: of the run, by an accurate one, as a part of what counts as wrong.
        failed: it did not come to its end, and said so.
    """

    drawn_value: float
    reported_before: tuple[str, ...]
    reported_after: tuple[str, ...]
    error: float
    failed: bool = False

    @property
    def is_wrong(self) -> bool:
        """Whether the run is really wrong: also where it failed or gave no number."""
        return not self.error <= 1.0


def build_model(scene: Scene, **options: Any) -> mstmm.Model:
    """A scene by the looped engine."""
    return mstmm.compile(mstmm.Scene(**{"gravity": [0, 0, 0], **scene}), engine="looped", **options)


def unique_names(risks: Iterable[Risk]) -> tuple[str, ...]:
    """Each once."""
    return tuple(dict.fromkeys(risk.name for risk in risks))


def run_trial(tested: mstmm.Model, t_end: float, **settings: Any) -> tuple[Result, tuple[str, ...]]:
    """A run, and the names of what was told before it; of its fixed step the run itself tells."""
    q, u = settings.get("initial") or tested.initial_state()
    method_settings = {key: value for key, value in settings.items() if key in ("method", "step")}
    reported = check_before_run(
        tested, Settings(t_end, **method_settings), np.asarray(q, float), np.asarray(u, float)
    ).risks
    run = tested.simulate(t_end, **settings)
    return run, unique_names((*reported, *(risk for risk in run.risks if risk.seen_before_run)))


def trial(drawn_value: float, run: Result, risks: tuple[str, ...], error: float) -> Trial:
    """The trial of a run with this error, in parts of what is wrong."""
    reported_after = unique_names(
        tuple(risk for risk in run.risks if not risk.seen_before_run and risk.invalidates)
    )
    return Trial(
        drawn_value, risks, reported_after, error if run.success else math.inf, not run.success
    )


def coordinate_error(run: Result, exact: Result) -> float:
    """Largest error of all coordinates at the times that both have: rad, or parts of the motion."""
    if not run.success:
        return math.inf
    measure = Coordinates(exact.model)
    measure.set_scales(exact.q)
    _, own_indices, reference_indices = np.intersect1d(run.t, exact.t, return_indices=True)
    return float(measure.distance(exact.q[reference_indices], run.q[own_indices]).max(initial=0.0))
