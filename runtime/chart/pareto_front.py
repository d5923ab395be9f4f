"""Which points count: sure errors, Pareto's front, and the cheapest for an error.

Pareto's front is of (sure error, processor time): a point is on it if no other is as accurate and
as cheap, and better in one of the two.  Runs whose step is longer than the motion needs have no
place on it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from mstmm.array_validation import finite_float
from mstmm.errors import NumericalFailure, SceneError

from .chart_points import Point, Reference

#: What `recommend` expects.
_ERROR = "a number above 0"


def bound_errors(
    points: Sequence[Point], reference: Reference, own: Mapping[str, float] | None = None
) -> tuple[Point, ...]:
    """The points with their sure errors, and marked where the reference limits them.

    Tighter settings that failed have no error and do not count.  `own` are the errors of levels of
    model by their names: settings that come below make up for it by chance.
    """
    found = []
    for point in points:
        if point.error is None:
            found.append(point)
            continue
        sure = max(
            other.error
            for other in points
            if other.curve == point.curve and other.setting.value <= point.setting.value
            and other.error is not None
        )  # fmt: skip
        sure = max(sure, (own or {}).get(point.setting.model, 0.0))
        limited = point.error <= reference.floor
        found.append(replace(point, sure_error=sure, limited=limited))
    return tuple(found)


def split_warnings(points: Sequence[Point]) -> tuple[tuple[Point, ...], tuple[str, ...]]:
    """The points without the warnings that all runs give, and these: no setting is to blame."""
    ran = [set(point.warnings) for point in points if point.error is not None]
    common = set.intersection(*ran) if len(ran) > 1 else set()
    if not common:
        return tuple(points), ()
    order = next(point.warnings for point in points if common <= set(point.warnings))
    without = tuple(
        replace(point, warnings=tuple(text for text in point.warnings if text not in common))
        for point in points
    )
    return without, tuple(text for text in order if text in common)


def front(points: Iterable[Point], floor: float = 0.0) -> tuple[Point, ...]:
    """Pareto's front, cheapest first; below `floor` no two errors can be told apart."""
    best: list[Point] = []
    for point in sorted(
        (
            p
            for p in points
            if p.sure_error is not None and p.cpu_s is not None and not p.too_coarse
        ),
        key=lambda p: (p.cpu_s, _sure(p, floor)),
    ):
        if not best or _sure(point, floor) < _sure(best[-1], floor):
            best.append(point)
    return tuple(best)


def _sure(point: Point, floor: float) -> float:
    assert point.sure_error is not None
    return max(point.sure_error, floor)


def recommend(points: Sequence[Point], error: float, reference: Reference) -> Point:
    """The cheapest point that errs by at most `error`, as all tighter settings of its curve do.

    SceneError for an error that is not a number above 0, NumericalFailure where nothing moves, the
    reference cannot judge so small an error, or no point meets it.
    """
    if not finite_float("error", error, _ERROR) > 0:
        raise SceneError(f"error = {error!r}: expected {_ERROR}")
    if reference.still:
        raise NumericalFailure(
            "nothing moves in this scene: every setting gives the same, so that there is nothing "
            "to choose"
        )
    if error < reference.floor:
        raise NumericalFailure(
            f"the reference itself errs by up to {reference.error:.1e}: it cannot judge errors "
            f"below {reference.floor:.1e}"
        )
    errors = [point.error for point in points if point.error is not None]
    if errors and not any(errors):
        raise NumericalFailure(
            f"no run errs at all in {reference.measure}, whatever its setting: that does not "
            "change in this motion; compare another quantity"
        )
    found = front(points, reference.floor)
    for point in found:
        if point.sure_error is not None and point.sure_error <= error:
            return point
    best = f"; the best that ran errs by {found[-1].sure_error:.1e}" if found else ""
    if any(p.too_coarse and p.sure_error is not None and p.sure_error <= error for p in points):
        best += "; those that err less have steps longer than the fastest motion allows"
    raise NumericalFailure(f"no setting errs by at most {error:.1e}{best}")
