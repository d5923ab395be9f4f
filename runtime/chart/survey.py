"""All curves of a chart, from their cheap settings to their accurate ones.

A curve is a method on a level of model.  All curves take their first setting, then all their
second one, so that where time ends the accurate settings are missing and not whole methods.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from .budget import SETTINGS
from .families import family, settings
from .measure import Measure
from .point import LeftOut, Point, Setting
from .trial import Runs, Trial, error_of, factorizations

if TYPE_CHECKING:
    from ..model.model import Model

#: The next setting costs this many times the last one where a curve has one point, and at most
#: and at least so many times where it has two.
_GROWTH, _MOST, _LEAST = 2.0, 10.0, 1.0

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
class Found:
    """What a survey gives: points, the models to repeat them with, and what was left out."""

    points: list[Point] = field(default_factory=list)
    models: list[Model] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)


def survey(
    curves: list[Curve], reference: Trial, measure: Measure, runs: Runs, tell: Callable[[str], None]
) -> Found:
    """Run them all within their part of the budget."""
    found = Found()
    while curves:
        curves = [one for one in curves if _advance(one, reference, measure, runs, tell, found)]
    return found


def _advance(
    one: Curve, reference: Trial, measure: Measure, runs: Runs, tell: Callable[[str], None],
    found: Found,
) -> bool:  # fmt: skip
    """One setting of one curve; False where the curve ends."""
    setting = next(one.ahead, None)
    if setting is None:
        return False
    limit = runs.budget.share(SETTINGS)
    if not limit or one.expected > limit:
        left, took = runs.budget.left(SETTINGS), f"about {one.expected:.2g} s"
        why = f"it would take {took} of the {left:.2g} s left" if limit else "no time was left"
        found.left_out.append(LeftOut(one.method, one.level, f"{setting} and on", why, False))
        return False
    tell(f"{one.level}: {one.method}, {setting}" if len(found.models) else one.method)
    trial = runs.trial(one.model, setting, measure, limit)
    if not one.costs and trial.numbers is not None:  # the first call also loads and compiles
        trial = runs.trial(one.model, setting, measure, limit)
    one.costs.append(trial.cpu_s)
    if trial.refused:
        found.left_out.append(LeftOut(one.method, one.level, "", trial.failure, True))
        return False
    point = point_of(trial, reference, measure)
    found.points.append(point)
    found.models.append(one.model)
    if trial.late:
        return False
    if point.error is not None and point.error <= one.enough:
        nothing = next(one.ahead, None)
        if nothing is not None:
            found.left_out.append(
                LeftOut(one.method, one.level, f"{nothing} and on", one.why_enough, False)
            )
        return False
    return True


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
    )  # fmt: skip


def family_order(method: str) -> tuple[str, str]:
    """For tables: by family, then by name."""
    return family(method), method
