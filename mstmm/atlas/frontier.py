"""Frontier between the parameter values at which a method holds and fails, by bisection."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ..errors import NumericalFailure
from .case_definition import Points, Scale


@dataclass(frozen=True)
class Frontier:
    """Last bracket of a frontier, and all measured points (parameter, measured) in order.

    `fails_at` is None if nothing failed.  `monotone` is False if the outcome changes more than once
    on the coarse grid: then the frontier is the first one from the side that holds.
    """

    holds_at: float
    fails_at: float | None
    monotone: bool
    points: Points


class MeasuredMethod:
    """Measured values of a method by parameter, each computed once."""

    def __init__(self, measure: Callable[[float], float], limit: float) -> None:
        self._measure, self._limit = measure, limit
        self._measured_values: dict[float, float] = {}

    def is_within_limit(self, value: float) -> bool:
        """Whether the measured value is within the limit; no answer counts as a failure."""
        if value not in self._measured_values:
            try:
                measured = float(self._measure(value))
            except NumericalFailure:
                measured = math.inf
            self._measured_values[value] = measured if math.isfinite(measured) else math.inf
        return self._measured_values[value] <= self._limit

    def points(self) -> Points:
        """Points measured so far, in the order of the parameter."""
        return tuple(sorted(self._measured_values.items()))


def find_frontier(
    method: MeasuredMethod, values: Sequence[float], scale: Scale, tolerance: float
) -> Frontier:
    """Find the frontier along `values`, where the first must hold and the last must fail.

    Raises NumericalFailure otherwise.
    """
    outcomes = [method.is_within_limit(value) for value in values]
    if not outcomes[0] or outcomes[-1]:
        outcome = "holds" if outcomes[0] else "fails"
        raise NumericalFailure(
            f"no frontier between {values[0]:g} and {values[-1]:g}: the method {outcome} at both "
            "ends"
        )
    return _bisect_first_change(method, values, outcomes, scale, tolerance)


def find_end(
    method: MeasuredMethod, values: Sequence[float], scale: Scale, tolerance: float
) -> Frontier:
    """Find how far along `values` a method holds; it must hold at the first.

    Raises NumericalFailure otherwise.
    """
    outcomes = [method.is_within_limit(value) for value in values]
    if not outcomes[0]:
        raise NumericalFailure(f"the remedy fails where the method does, at {values[0]:g}")
    if all(outcomes):
        return Frontier(values[-1], None, True, method.points())
    return _bisect_first_change(method, values, outcomes, scale, tolerance)


def _bisect_first_change(
    method: MeasuredMethod,
    values: Sequence[float],
    outcomes: Sequence[bool],
    scale: Scale,
    tolerance: float,
) -> Frontier:
    """Bisect the first interval of `values` where the outcome changes, down to `tolerance`."""
    changes = sum(a != b for a, b in pairwise(outcomes))
    first_failure = outcomes.index(False)
    holding_value, failing_value = values[first_failure - 1], values[first_failure]
    while (midpoint := scale.middle(holding_value, failing_value, tolerance)) is not None:
        if method.is_within_limit(midpoint):
            holding_value = midpoint
        else:
            failing_value = midpoint
    return Frontier(holding_value, failing_value, changes == 1, method.points())
