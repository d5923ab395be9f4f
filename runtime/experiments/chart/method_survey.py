"""Run all methods of a chart on all model levels, from cheap to accurate settings.

A curve is a method on a model level.  All curves run their first setting, then all their second
one, so that a lack of time drops the most accurate settings and no whole methods.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ...run import external_integrators
from ..error_measure import Measure
from ..method_families import settings
from ..runs import Runs
from ..trial import Setting, Trial, max_error
from ..tuning import CHART as TUNING
from .chart_record import Point, Skipped

if TYPE_CHECKING:
    from ..simulation import SimulatedScene


#: Reason why a curve ends before its last setting.
_NO_TIME = "too little time left"


@dataclass
class Curve:
    """Curve of a chart: a method on a model level, its remaining settings, and costs so far.

    The curve ends at the error `sufficient_error`: the smallest one that the reference resolves, or
    the error of the model level; `sufficiency_reason` states which.  `costs` are CPU times, s.
    """

    method: str
    level: str
    model: SimulatedScene
    sufficient_error: float
    sufficiency_reason: str
    next_settings: Iterator[Setting]
    costs: list[float] = field(default_factory=list)

    @property
    def expected_seconds(self) -> float:
        """Estimated CPU time of the next setting, s; 0 if unknown."""
        if not self.costs:
            return 0.0
        growth = TUNING.growth
        if len(self.costs) > 1 and self.costs[-2] > 0:
            growth = min(max(self.costs[-1] / self.costs[-2], TUNING.min_growth), TUNING.max_growth)
        return growth * self.costs[-1]


def method_curve(
    method: str,
    level: str,
    model: SimulatedScene,
    t_end: float,
    floor: float,
    level_error: float | None,
) -> Curve:
    """Curve of a method on a model level whose error is `level_error`, None for the reference.

    `floor` is the smallest error that the reference resolves.
    """
    enough, why = floor, "the reference does not resolve smaller errors"
    if level_error is not None and TUNING.level_error_factor * level_error > floor:
        enough = TUNING.level_error_factor * level_error
        why = "the remaining error is that of the model level"
    return Curve(method, level, model, enough, why, settings(method, level, t_end))


@dataclass
class SurveyResult:
    """Points of a survey, the model of each point, and what was skipped."""

    points: list[Point] = field(default_factory=list)
    models: list[SimulatedScene] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)


class Survey:
    """Run of all curves within a time budget; collects points in `result`."""

    def __init__(
        self, reference: Trial, measure: Measure, runs: Runs, tell: Callable[[str], None]
    ) -> None:
        self.reference, self.measure, self.runs, self.report = reference, measure, runs, tell
        self.result = SurveyResult()

    def run_curves(self, curves: list[Curve], part: float) -> SurveyResult:
        """Run all curves, one setting of each in turn, until this part of the budget is spent."""
        while curves:
            waiting = len(curves)
            curves = [
                curve
                for curve in curves
                if self._run_next(curve, self.runs.budget.run_limit(part, waiting))
            ]
        return self.result

    def _run_next(self, curve: Curve, limit: float) -> bool:
        """Run the next setting of a curve within `limit` s; return False if the curve ends."""
        setting = next(curve.next_settings, None)
        if setting is None:
            return False
        if not limit or curve.expected_seconds > limit:
            self._skip(curve, f"{setting} and tighter", _NO_TIME)
            return False
        self.report(f"{curve.level}: {curve.method}, {setting}")
        trial = self.runs.trial(curve.model, setting, self.measure, limit)
        if (
            not curve.costs
            and trial.numbers is not None
            and _may_include_loading(trial, curve.model)
        ):
            trial = self.runs.trial(curve.model, setting, self.measure, limit)
        curve.costs.append(trial.cpu_s)
        if trial.refused:
            self._skip(curve, "", trial.failure, refused=True)
            return False
        point = chart_point(trial, self.reference, self.measure)
        self.result.points.append(point)
        self.result.models.append(curve.model)
        return not (trial.late or self._is_accurate_enough(curve, point))

    def _is_accurate_enough(self, curve: Curve, point: Point) -> bool:
        """Whether tighter settings cannot show smaller errors; skips the next one if so."""
        if point.error is None or point.error > curve.sufficient_error:
            return False
        following = next(curve.next_settings, None)
        if following is not None:
            self._skip(curve, f"{following} and tighter", curve.sufficiency_reason)
        return True

    def _skip(self, curve: Curve, setting: str, reason: str, refused: bool = False) -> None:
        self.result.skipped.append(Skipped(curve.method, curve.level, setting, reason, refused))


def _may_include_loading(trial: Trial, model: SimulatedScene) -> bool:
    """Whether the CPU time of a first call may include loading or compiling the method."""
    return trial.cpu_s < TUNING.loading_limit or model.engine != "looped"


def chart_point(trial: Trial, reference: Trial, measure: Measure) -> Point:
    """Point of a run, without error bound."""
    if trial.numbers is None:
        return Point(trial.setting, failure=trial.failure)
    error, reason = max_error(trial, reference, measure)
    if reason:
        return Point(trial.setting, failure=reason)
    counts = trial.trajectory.statistics
    # External integrators do not count their factorised tangent matrices.
    is_counted = counts is not None and trial.setting.method not in external_integrators.METHODS
    return Point(
        trial.setting, error, trial.cpu_s, 1,
        None if counts is None else counts.evaluations, counts.tangents if is_counted else None,
        None if counts is None else counts.steps,
        warnings=trial.warnings, is_too_coarse=trial.too_coarse,
    )  # fmt: skip


# --- repeated timing ---


def repeat_timings(
    points: list[Point],
    models: list[SimulatedScene],
    rounds: int,
    runs: Runs,
    report: Callable[[str], None],
) -> tuple[list[Point], int]:
    """Repeat the timing of points; return them, and how many missed at least one round.

    CPU times become the smallest of all runs.  A round runs cheap points first, and skips points
    that no longer fit into the budget; very long runs are not repeated.
    """
    timed = list(points)
    longest = runs.budget.remaining() / TUNING.min_runs
    times = {i: point.cpu_s for i, point in enumerate(points) if point.cpu_s is not None}
    order = sorted((i for i in times if times[i] <= longest), key=lambda i: (times[i], i))
    missed: set[int] = set()
    for number in range(rounds):
        report(f"repeat timings, round {number + 1} of {rounds}")
        remaining = rounds - number
        reserved = runs.budget.remaining() * (remaining - 1) / remaining  # for the later rounds
        missed |= {i for i in order if not _time_point(timed, i, models[i], runs, reserved)}
    return timed, len(missed) + len(times) - len(order)


def _time_point(
    timed: list[Point], i: int, model: SimulatedScene, runs: Runs, reserved: float
) -> bool:
    """Time point i again; return False if that would use the reserved time (s)."""
    point = timed[i]
    assert point.cpu_s is not None
    left, once = runs.budget.remaining() - reserved, max(point.cpu_s, 1e-6)
    calls = max(1, min(TUNING.max_calls, int(TUNING.round_cpu_s / once)))
    if calls * once > left:
        return False
    cpu_s = runs.cpu_s(model, point.setting, left, calls)
    if cpu_s is None:
        return False
    timed[i] = replace(point, cpu_s=min(point.cpu_s, cpu_s), repeats=point.repeats + calls)
    return True
