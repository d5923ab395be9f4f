"""Run all methods of a chart on all model levels, from cheap to accurate settings.

A curve is a method on a model level.  All curves run their first setting, then all their second
one, so that a lack of time drops the most accurate settings and no whole methods.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ...run import external_integrators
from ..error_measure import Measure
from ..method_families import settings
from ..runs import Report, Runs
from ..trial import Setting, Trial, max_error
from ..tuning import CHART as TUNING
from .chart_record import Point, Skipped

if TYPE_CHECKING:
    from ..simulation import SimulatedScene


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

    def skipped(self, setting: str, reason: str, is_unsupported: bool = False) -> Skipped:
        """Record of settings of this curve that are not run."""
        return Skipped(self.method, self.level, setting, reason, is_unsupported)

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
class Survey:
    """Runs of curves within a time budget.

    Attributes:
        reference, measure: run that errors are relative to, and their measure.
        runs: runs within the time budget.
        report: callback with a sentence before every run.
        points, models: points so far, and the model of each.
        skipped: settings that were not run.
    """

    reference: Trial
    measure: Measure
    runs: Runs
    report: Report
    points: list[Point] = field(default_factory=list)
    models: list[SimulatedScene] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)

    def run_curves(self, curves: list[Curve], part: float) -> None:
        """Run all curves, one setting of each in turn, until this part of the budget is spent."""
        while curves:
            waiting, budget = len(curves), self.runs.budget
            curves = [c for c in curves if self._run_next(c, budget.run_limit(part, waiting))]

    def _run_next(self, curve: Curve, limit: float) -> bool:
        """Run the next setting of a curve within `limit` s; return False if the curve ends."""
        setting = next(curve.next_settings, None)
        if setting is None:
            return False
        if not limit or curve.expected_seconds > limit:
            self.skipped.append(curve.skipped(f"{setting} and tighter", "too little time left"))
            return False
        self.report(f"{curve.level}: {curve.method}, {setting}")
        trial = self.runs.trial(curve.model, setting, self.measure, limit)
        # The CPU time of a first call may include loading or compiling the method.
        may_load = trial.cpu_s < TUNING.loading_limit or curve.model.engine != "looped"
        if not curve.costs and trial.numbers is not None and may_load:
            trial = self.runs.trial(curve.model, setting, self.measure, limit)
        curve.costs.append(trial.cpu_s)
        if trial.refused:
            self.skipped.append(curve.skipped("", trial.failure, is_unsupported=True))
            return False
        point = chart_point(trial, self.reference, self.measure)
        self.points.append(point)
        self.models.append(curve.model)
        if trial.late or point.error is None or point.error > curve.sufficient_error:
            return not trial.late
        # Tighter settings cannot show smaller errors.
        following = next(curve.next_settings, None)
        if following is not None:
            reason = curve.sufficiency_reason
            self.skipped.append(curve.skipped(f"{following} and tighter", reason))
        return False


def chart_point(trial: Trial, reference: Trial, measure: Measure) -> Point:
    """Point of a run, without error bound."""
    if trial.numbers is None:
        return Point(trial.setting, failure=trial.failure)
    error, reason = max_error(trial, reference, measure)
    if reason:
        return Point(trial.setting, failure=reason)
    counts = trial.trajectory.statistics
    # External integrators do not count their factorised tangent matrices.
    is_external = trial.setting.method in external_integrators.METHODS
    return Point(
        trial.setting, error, trial.cpu_s, 1, counts.evaluations,
        None if is_external else counts.tangents, counts.steps, warnings=trial.warnings,
        is_too_coarse=trial.too_coarse,
    )  # fmt: skip


# --- repeated timing ---


def repeat_timings(
    points: list[Point], models: list[SimulatedScene], rounds: int, runs: Runs, report: Report
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
