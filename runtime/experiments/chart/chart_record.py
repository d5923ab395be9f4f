"""Data of a chart: points, skipped runs, levels, reference, Pareto front, recommendations."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from mstmm.array_validation import finite_float
from mstmm.errors import MstmmError, NumericalFailure, SceneError
from mstmm.plain_data import to_plain

from ..trial import Setting


@dataclass(frozen=True)
class Point:
    """Point of a chart: error and CPU time of one setting.

    Attributes:
        setting: method, model level and tolerance or step.
        error: largest deviation from the reference over the samples; None for a run that failed.
        cpu_s: CPU time of the whole call of `simulate`, the smallest of `repeats` calls; s.
        evaluations, factorizations, steps: counts of the run, None if the method does not count.
        failure: reason why the run gave no error, "" if it did.
        reference_limited: the error is small enough to be the error of the reference.
        error_bound: error bound: largest error of this setting and all tighter ones of its curve,
            so that an accidentally small error does not count.
        warnings: warnings of this run.
        is_too_coarse: the fixed step is too long for the fastest motion; such a run is not trusted
            and never recommended, however small its error.
    """

    setting: Setting
    error: float | None = None
    cpu_s: float | None = None
    repeats: int = 0
    evaluations: int | None = None
    factorizations: int | None = None
    steps: int | None = None
    failure: str = ""
    reference_limited: bool = False
    error_bound: float | None = None
    warnings: tuple[str, ...] = ()
    is_too_coarse: bool = False

    @property
    def method(self) -> str:
        """Name of the method."""
        return self.setting.method

    @property
    def model(self) -> str:
        """Name of the model level."""
        return self.setting.model

    @property
    def curve(self) -> tuple[str, str]:
        """(model level, method): key of the points that differ only in tolerance or step."""
        return self.setting.model, self.setting.method

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "method": self.method, "model": self.model, "setting": self.setting.numbers,
            "error": self.error, "sure_error": self.error_bound, "cpu_s": self.cpu_s,
            "repeats": self.repeats, "evaluations": self.evaluations,
            "factorizations": self.factorizations, "steps": self.steps,
            "limited_by_reference": self.reference_limited, "failure": self.failure or None,
            "warnings": list(self.warnings), "too_coarse": self.is_too_coarse,
        }  # fmt: skip


@dataclass(frozen=True)
class Skipped:
    """Method, model level or tighter settings of a curve that were not run, with the reason.

    `is_unsupported`: the scene or the machine does not support it; otherwise time was short, or it
    would have shown nothing new.
    """

    method: str
    model: str
    setting: str
    reason: str
    is_unsupported: bool

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "method": self.method or None, "model": self.model or None,
            "setting": self.setting or None, "reason": self.reason, "refused": self.is_unsupported,
        }  # fmt: skip

    def __str__(self) -> str:
        name = ", ".join(part for part in (self.model, self.method, self.setting) if part)
        return f"{name}: {self.reason}"


@dataclass(frozen=True)
class Level:
    """Model level: name, error (None if unknown), degrees of freedom, and engine."""

    name: str
    error: float | None
    degrees_of_freedom: int
    engine: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return to_plain(self)


@dataclass(frozen=True)
class Reference:
    """Reference solution that errors are relative to.

    Attributes:
        error: error of the reference itself, in the same measure as all others.
        made_by: description of the runs that were compared.
        model: name of its model level.
        measure, unit, scaling: compared quantity, its unit, and what it is divided by.
        stop_event: event that ended its run, and when; "" if none did.
        is_static: no coordinate moves.
    """

    error: float
    made_by: str
    model: str
    measure: str
    unit: str
    scaling: str
    stop_event: str = ""
    is_static: bool = False

    @property
    def smallest_resolved_error(self) -> float:
        """Smallest resolved error: errors below it may be those of the reference."""
        return 3.0 * self.error

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in chart.json."""
        return {
            "error": self.error, "made_by": self.made_by, "model": self.model,
            "measure": self.measure, "unit": self.unit, "scaling": self.scaling,
            "ended": self.stop_event or None, "still": self.is_static,
        }  # fmt: skip


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


#: Valid values of `error`, for messages.
_EXPECTED = "a number above 0"


def bound_errors(
    points: Sequence[Point], reference: Reference, level_errors: Mapping[str, float] | None = None
) -> tuple[Point, ...]:
    """Add error bounds to the points, and mark those limited by the error of the reference.

    The bound is the largest error of a setting and all tighter ones of its curve; settings that
    failed do not count.  `level_errors` are the errors of model levels by name: a smaller error on
    such a level is accidental.
    """
    bounded = []
    for point in points:
        if point.error is None:
            bounded.append(point)
            continue
        bound = max(
            other.error
            for other in points
            if other.curve == point.curve and other.setting.value <= point.setting.value
            and other.error is not None
        )  # fmt: skip
        bound = max(bound, (level_errors or {}).get(point.setting.model, 0.0))
        limited = point.error <= reference.smallest_resolved_error
        bounded.append(replace(point, error_bound=bound, reference_limited=limited))
    return tuple(bounded)


def split_warnings(points: Sequence[Point]) -> tuple[tuple[Point, ...], tuple[str, ...]]:
    """Split off the warnings that all runs give, which do not depend on the setting.

    Returns the points without these warnings, and the warnings.
    """
    warning_sets = [set(point.warnings) for point in points if point.error is not None]
    common = set.intersection(*warning_sets) if len(warning_sets) > 1 else set()
    if not common:
        return tuple(points), ()
    order = next(point.warnings for point in points if common <= set(point.warnings))
    remaining = tuple(
        replace(point, warnings=tuple(text for text in point.warnings if text not in common))
        for point in points
    )
    return remaining, tuple(text for text in order if text in common)


def pareto_front(points: Iterable[Point], floor: float = 0.0) -> tuple[Point, ...]:
    """Pareto front, cheapest first; errors below `floor` count as equal."""
    best: list[Point] = []
    for point in sorted(
        (
            p
            for p in points
            if p.error_bound is not None and p.cpu_s is not None and not p.is_too_coarse
        ),
        key=lambda p: (p.cpu_s, _resolved_error(p, floor)),
    ):
        if not best or _resolved_error(point, floor) < _resolved_error(best[-1], floor):
            best.append(point)
    return tuple(best)


def _resolved_error(point: Point, floor: float) -> float:
    assert point.error_bound is not None
    return max(point.error_bound, floor)


def recommend(points: Sequence[Point], error: float, reference: Reference) -> Point:
    """Cheapest point whose error bound does not exceed `error`.

    Raises SceneError for an error that is not a number above 0, and NumericalFailure if nothing
    moves, the reference does not resolve such an error, or no point reaches it.
    """
    if not finite_float("error", error, _EXPECTED) > 0:
        raise SceneError(f"error = {error!r}: expected {_EXPECTED}")
    if reference.is_static:
        raise NumericalFailure(
            "the scene has no degrees of freedom: all settings give the same result, nothing to "
            "recommend"
        )
    if error < reference.smallest_resolved_error:
        raise NumericalFailure(
            f"error of the reference up to {reference.error:.1e}: it does not resolve errors below "
            f"{reference.smallest_resolved_error:.1e}; give a larger target error"
        )
    errors = [point.error for point in points if point.error is not None]
    if errors and not any(errors):
        raise NumericalFailure(
            f"all runs have zero error of {reference.measure}, which does not change in this "
            "motion; compare another quantity"
        )
    front = pareto_front(points, reference.smallest_resolved_error)
    for point in front:
        if point.error_bound is not None and point.error_bound <= error:
            return point
    best = f"; the smallest error reached is {front[-1].error_bound:.1e}" if front else ""
    if any(
        p.is_too_coarse and p.error_bound is not None and p.error_bound <= error for p in points
    ):
        best += "; runs with smaller errors have a fixed step too long for the fastest motion"
    raise NumericalFailure(f"no setting reaches an error of {error:.1e}{best}")
