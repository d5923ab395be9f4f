"""Data of a work-precision chart: points, reference, Pareto front and recommendations."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from mstmm.errors import MstmmError

from .chart_points import Level, Point, Reference, Skipped
from .pareto_front import pareto_front, recommend

#: Target errors for which the cheapest setting is listed.
TARGET_ERRORS = tuple(10.0**-k for k in range(1, 11))


@dataclass(frozen=True)
class ChartRecord:
    """Work-precision chart of a scene; `Chart` adds plots and files.

    Attributes:
        title: title of the plot.
        t_end: end of the runs, s.
        samples: number of times at which the error is evaluated.
        reference: reference solution that errors are relative to, and its own error.
        points: every run; see `Point`.
        model_levels: model levels from the smallest to the richest, with their own errors.
        skipped: methods and levels that were rejected, settings that were not run, and why.
        target_error: target error of the recommended setting.
        budget, elapsed: wall-clock time allowed and used, s.
        sampling_text: description of the times at which the error is evaluated.
        warnings: warnings of the scene, and those that every run of it gives.
    """

    title: str
    t_end: float
    samples: int
    reference: Reference
    points: tuple[Point, ...]
    model_levels: tuple[Level, ...]
    skipped: tuple[Skipped, ...]
    target_error: float
    budget: float
    elapsed: float
    sampling_text: str = ""
    warnings: tuple[str, ...] = ()

    @cached_property
    def pareto_front(self) -> tuple[Point, ...]:
        """Pareto front of error bound (`sure_error`) and CPU time, cheapest first."""
        return pareto_front(self.points, self.reference.smallest_resolved_error)

    def recommend(self, error: float | None = None) -> Point:
        """Cheapest point whose error bound does not exceed `error` (default: `target_error`).

        Raises SceneError for an error that is not above 0, and NumericalFailure, with the smallest
        error that was reached, if no point meets it or the reference is not accurate enough.
        """
        target_error = self.target_error if error is None else error
        return recommend(self.points, target_error, self.reference)

    def recommendations(self) -> list[tuple[float, Point]]:
        """(target error, recommended point) for every power of ten that is reached."""
        recommendations = []
        for error in TARGET_ERRORS:
            try:
                recommendations.append((error, self.recommend(error)))
            except MstmmError:
                break
        return recommendations

    def to_dict(self) -> dict[str, Any]:
        """All data as plain values, as in chart.json."""
        best, why = None, None
        try:
            best = self.recommend().to_dict()
        except MstmmError as problem:
            why = str(problem)
        return {
            "scene": self.title, "t_end": self.t_end, "samples": self.samples,
            "times": self.sampling_text, "reference": self.reference.to_dict(),
            "points": [point.to_dict() for point in self.points],
            "front": [point.to_dict() for point in self.pareto_front], "recommended": best,
            "recommended_for": self.target_error, "not_recommended": why,
            "advice": [{"asked": e, **point.to_dict()} for e, point in self.recommendations()],
            "models": [level.to_dict() for level in self.model_levels],
            "left_out": [skipped.to_dict() for skipped in self.skipped],
            "warnings": list(self.warnings), "budget_s": self.budget, "spent_s": self.elapsed,
        }  # fmt: skip

    def to_json(self) -> str:
        """All data as JSON text."""
        return json.dumps(self.to_dict(), indent=2, allow_nan=False) + "\n"
