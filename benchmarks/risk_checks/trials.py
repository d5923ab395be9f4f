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

    drawn: float
    before: tuple[str, ...]
    after: tuple[str, ...]
    error: float
    failed: bool = False

    @property
    def wrong(self) -> bool:
        """Whether the run is really wrong: also where it failed or gave no number."""
        return not self.error <= 1.0


def model(scene: Scene, **options: Any) -> mstmm.Model:
    """A scene by the looped engine."""
    return mstmm.compile(mstmm.Scene(**{"gravity": [0, 0, 0], **scene}), engine="looped", **options)


def names(risks: Iterable[Risk]) -> tuple[str, ...]:
    """Each once."""
    return tuple(dict.fromkeys(risk.name for risk in risks))


def tried(one: mstmm.Model, t_end: float, **settings: Any) -> tuple[Result, tuple[str, ...]]:
    """A run, and the names of what was told before it; of its fixed step the run itself tells."""
    q, u = settings.get("initial") or one.initial_state()
    known = {key: value for key, value in settings.items() if key in ("method", "step")}
    seen = check_before_run(
        one, Settings(t_end, **known), np.asarray(q, float), np.asarray(u, float)
    ).risks
    run = one.simulate(t_end, **settings)
    return run, names((*seen, *(risk for risk in run.risks if risk.seen_before_run)))


def judged(drawn: float, run: Result, before: tuple[str, ...], error: float) -> Trial:
    """The trial of a run with this error, in parts of what is wrong."""
    after = names(
        tuple(risk for risk in run.risks if not risk.seen_before_run and risk.invalidates)
    )
    return Trial(drawn, before, after, error if run.success else math.inf, not run.success)


def off(run: Result, exact: Result) -> float:
    """Largest error of all coordinates at the times that both have: rad, or parts of the motion."""
    if not run.success:
        return math.inf
    measure = Coordinates(exact.model)
    measure.set_scales(exact.q)
    _, ours, theirs = np.intersect1d(run.t, exact.t, return_indices=True)
    return float(measure.distance(exact.q[theirs], run.q[ours]).max(initial=0.0))
