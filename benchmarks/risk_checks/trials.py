"""A run with the risks reported before and after it, and its true error."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

import mstmm
from mstmm.risk import Risk
from mstmm.runtime.experiments.error_measure import Coordinates
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result.checks.check import RunStart
from mstmm.runtime.result.checks.run_checks import check_before_run
from mstmm.runtime.result.result import Result

Scene = dict[str, Any]


@dataclass(frozen=True)
class Trial:
    """Outcome of one run.

    Attributes:
        drawn_value: random parameter, on both sides of the value at which the method fails.
        reported_before, reported_after: names of the risks reported before and after the run.
        error: error against an accurate run, relative to the bound of a wrong run.
        failed: whether the run reported a failure.
    """

    drawn_value: float
    reported_before: tuple[str, ...]
    reported_after: tuple[str, ...]
    error: float
    failed: bool = False

    @property
    def is_wrong(self) -> bool:
        """Whether the run is wrong, failed or is not finite."""
        return not self.error <= 1.0


def build_model(scene: Scene, **options: Any) -> mstmm.Model:
    """Model on the looped engine."""
    return mstmm.compile(mstmm.Scene(**{"gravity": [0, 0, 0], **scene}), engine="looped", **options)


def unique_names(risks: Iterable[Risk]) -> tuple[str, ...]:
    """Names without repetition."""
    return tuple(dict.fromkeys(risk.name for risk in risks))


def run_trial(tested: mstmm.Model, t_end: float, **settings: Any) -> tuple[Result, tuple[str, ...]]:
    """A run and the names of the risks reported before it."""
    q, u = settings.get("initial") or tested.initial_state()
    method_settings = {key: value for key, value in settings.items() if key in ("method", "step")}
    start = RunStart(
        tested, Settings(t_end, **method_settings), np.asarray(q, float), np.asarray(u, float)
    )
    reported = check_before_run(start).risks
    run = tested.simulate(t_end, **settings)
    return run, unique_names((*reported, *(risk for risk in run.risks if risk.seen_before_run)))


def trial(drawn_value: float, run: Result, risks: tuple[str, ...], error: float) -> Trial:
    """Outcome of a run with an error relative to the bound of a wrong run."""
    reported_after = unique_names(
        tuple(risk for risk in run.risks if not risk.seen_before_run and risk.invalidates)
    )
    return Trial(
        drawn_value, risks, reported_after, error if run.success else math.inf, not run.success
    )


def coordinate_error(run: Result, exact: Result) -> float:
    """Largest error of all coordinates at common times: rad, or relative to the motion."""
    if not run.success:
        return math.inf
    measure = Coordinates(exact.model)
    measure.set_scales(exact.q)
    _, own_indices, reference_indices = np.intersect1d(run.t, exact.t, return_indices=True)
    return float(measure.distance(exact.q[reference_indices], run.q[own_indices]).max(initial=0.0))
