"""Error bounds, Pareto front, and the cheapest setting for a target error.

A point is on the Pareto front of (error bound, CPU time) if no other point is as accurate and as
cheap, and better in one of the two.  Runs with a too long fixed step are excluded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from mstmm.array_validation import finite_float
from mstmm.errors import NumericalFailure, SceneError

from .chart_points import Point, Reference

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
