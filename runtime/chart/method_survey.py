"""All curves of a chart, from their cheap settings to their accurate ones.

A curve is a method on a level of model.  All curves take their first setting, then all their
second one, so that where time ends the accurate settings are missing and not whole methods.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ..result.error_measure import Measure
from .chart_points import Point, Setting, Skipped
from .method_families import settings
from .trial_run import Runs, Trial, error_of, factorizations

if TYPE_CHECKING:
    from ..model.model import Model

#: The next setting costs this many times the last one where a curve has one point, and at most
#: and at least so many times where it has two.
_GROWTH, _MOST, _LEAST = 2.0, 10.0, 1.0

#: Processor time (s) beside which the loading of a method does not count.
_LOADING = 1.0

#: Why a curve ends before its last setting.
_NO_TIME = "it would have taken more than its part of the time left"

#: A level of model errs by so much that settings nearer to its own error show nothing more.
_NEAR = 1.1


@dataclass
class Curve:
    """A method on a level of model, with what is known of it so far.

    `enough` is the error at which it ends: what the reference can tell, or the level's own.
    """

    method: str
    level: str
    model: Model
    enough: float
    why_enough: str
    ahead: Iterator[Setting]
    costs: list[float] = field(default_factory=list)

    @property
    def expected(self) -> float:
        """Seconds that the next setting will take, about; 0 where nothing is known."""
        if not self.costs:
            return 0.0
        growth = _GROWTH
        if len(self.costs) > 1 and self.costs[-2] > 0:
            growth = min(max(self.costs[-1] / self.costs[-2], _LEAST), _MOST)
        return growth * self.costs[-1]


def curve(
    method: str, level: str, model: Model, t_end: float, floor: float, own: float | None
) -> Curve:
    """The curve of a method on a level whose own error is `own`, None for the reference's."""
    enough, why = floor, "the reference can tell no smaller errors"
    if own is not None and _NEAR * own > floor:
        enough, why = _NEAR * own, "what is left is the error of the level of model"
    return Curve(method, level, model, enough, why, settings(method, level, t_end))


@dataclass
class SurveyResult:
    """What a survey gives: points, the models to repeat them with, and what was left out."""

    points: list[Point] = field(default_factory=list)
    models: list[Model] = field(default_factory=list)
    left_out: list[Skipped] = field(default_factory=list)


class Survey:
    """Runs curves against a reference within their part of the budget; `found` fills."""

    def __init__(
        self, reference: Trial, measure: Measure, runs: Runs, tell: Callable[[str], None]
    ) -> None:
        self.reference, self.measure, self.runs, self.tell = reference, measure, runs, tell
        self.found = SurveyResult()

    def make(self, curves: list[Curve], part: float) -> SurveyResult:
        """All of them, a setting of each at a time, until this part of the budget is spent."""
        while curves:
            waiting = len(curves)
            curves = [
                one for one in curves if self._advance(one, self.runs.budget.share(part, waiting))
            ]
        return self.found

    def _advance(self, one: Curve, limit: float) -> bool:
        """One setting of one curve; False where the curve ends."""
        setting = next(one.ahead, None)
        if setting is None:
            return False
        if not limit or one.expected > limit:
            self._left(one, f"{setting} and on", _NO_TIME)
            return False
        self.tell(f"{one.level}: {one.method}, {setting}")
        trial = self.runs.trial(one.model, setting, self.measure, limit)
        if not one.costs and trial.numbers is not None and _may_be_first(trial, one.model):
            trial = self.runs.trial(one.model, setting, self.measure, limit)
        one.costs.append(trial.cpu_s)
        if trial.refused:
            self._left(one, "", trial.failure, refused=True)
            return False
        point = point_of(trial, self.reference, self.measure)
        self.found.points.append(point)
        self.found.models.append(one.model)
        return not (trial.late or self._enough(one, point))

    def _enough(self, one: Curve, point: Point) -> bool:
        """Whether tighter settings would show nothing more."""
        if point.error is None or point.error > one.enough:
            return False
        following = next(one.ahead, None)
        if following is not None:
            self._left(one, f"{following} and on", one.why_enough)
        return True

    def _left(self, one: Curve, setting: str, why: str, refused: bool = False) -> None:
        self.found.left_out.append(Skipped(one.method, one.level, setting, why, refused))


def _may_be_first(trial: Trial, model: Model) -> bool:
    """Whether the time of a first call may be that of loading a method, or of compiling for it."""
    return trial.cpu_s < _LOADING or model.engine != "looped"


def point_of(trial: Trial, reference: Trial, measure: Measure) -> Point:
    """The point of a run, not yet judged beside the others."""
    if trial.numbers is None:
        return Point(trial.setting, failure=trial.failure)
    error, counts = error_of(trial, reference, measure), trial.statistics
    if isinstance(error, str):
        return Point(trial.setting, failure=error)
    return Point(
        trial.setting, error, trial.cpu_s, 1,
        None if counts is None else counts.evaluations, factorizations(trial.setting, counts),
        None if counts is None else counts.steps,
        warnings=trial.warnings, too_coarse=trial.too_coarse,
    )  # fmt: skip
