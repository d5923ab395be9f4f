"""What a chart knows: points, the reference they were measured against, the front, what to take."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mstmm.errors import MstmmError

from . import pareto_front as fronts
from .chart_points import Level, Point, Reference, Skipped

#: Errors for which the cheapest setting is told.
ASKED = tuple(10.0**-k for k in range(1, 11))


@dataclass(frozen=True)
class ChartRecord:
    """Cost against accuracy of one scene; `Chart` adds the ways out of it.

    Attributes:
        title: what was charted.
        t_end: end of the runs, s; `samples` is at how many times errors were looked at.
        reference: what errors are measured against, and its own error.
        points: every run; see `Point`.
        levels: of model, from the smallest to the richest, with their own errors.
        left_out: methods and levels that were refused, settings that were not run, and why.
        wanted: the error for which a setting was asked.
        budget, spent: s of the clock.
        looked: how the times lie at which errors were looked at, in words.
        warnings: what the scene, and every run of it, warns of, whatever the method.
    """

    title: str
    t_end: float
    samples: int
    reference: Reference
    points: tuple[Point, ...]
    levels: tuple[Level, ...]
    left_out: tuple[Skipped, ...]
    wanted: float
    budget: float
    spent: float
    looked: str = ""
    warnings: tuple[str, ...] = ()

    @cached_property
    def front(self) -> tuple[Point, ...]:
        """Pareto's front of sure error and processor time, cheapest first."""
        return fronts.front(self.points, self.reference.floor)

    def recommended(self, error: float | None = None) -> Point:
        """The cheapest point that errs by at most `error` (the wanted one unless given), as do all
        tighter settings of its method.

        SceneError for an error that is not above 0, NumericalFailure, with what there is, where no
        point meets it or the reference cannot tell.
        """
        asked = self.wanted if error is None else error
        return fronts.recommend(self.points, asked, self.reference)

    def advice(self) -> list[tuple[float, Point]]:
        """(error, recommended point) for every power of ten that a point meets."""
        found = []
        for error in ASKED:
            try:
                found.append((error, self.recommended(error)))
            except MstmmError:
                break
        return found

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain values."""
        best, why = None, None
        try:
            best = self.recommended().to_dict()
        except MstmmError as error:
            why = str(error)
        return {
            "scene": self.title, "t_end": self.t_end, "samples": self.samples, "times": self.looked,
            "reference": self.reference.to_dict(),
            "points": [point.to_dict() for point in self.points],
            "front": [point.to_dict() for point in self.front],
            "recommended": best, "recommended_for": self.wanted, "not_recommended": why,
            "advice": [{"asked": e, **point.to_dict()} for e, point in self.advice()],
            "models": [level.to_dict() for level in self.levels],
            "left_out": [one.to_dict() for one in self.left_out],
            "warnings": list(self.warnings), "budget_s": self.budget, "spent_s": self.spent,
        }  # fmt: skip

    def to_json(self) -> str:
        """The same as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"
