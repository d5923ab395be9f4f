"""Frontier between the parameter values at which a method holds and fails, by bisection."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from ..errors import NumericalFailure
from .scale import Scale

Points = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Frontier:
    """Last bracket of a frontier, and all measured points (parameter, measured) in order.

    `fails_at` is None if nothing failed.  `monotone` is False if the coarse grid changes sides more
    than once: then the frontier is the first one from the side that holds.
    """

    holds_at: float
    fails_at: float | None
    monotone: bool
    points: Points


class Tried:
    """Measured values of a method by parameter, each computed once."""

    def __init__(self, measure: Callable[[float], float], limit: float) -> None:
        self._measure, self._limit = measure, limit
        self._found: dict[float, float] = {}

    def holds(self, value: float) -> bool:
        """Whether the measured value is within the limit; no answer counts as a failure."""
        if value not in self._found:
            try:
                found = float(self._measure(value))
            except NumericalFailure:
                found = math.inf
            self._found[value] = found if math.isfinite(found) else math.inf
        return self._found[value] <= self._limit

    def points(self) -> Points:
        """Points measured so far, in the order of the parameter."""
        return tuple(sorted(self._found.items()))


def bracketed(tried: Tried, values: Sequence[float], scale: Scale, tolerance: float) -> Frontier:
    """Find the frontier along `values`, where the first must hold and the last must fail.

    Raises NumericalFailure otherwise.
    """
    sides = [tried.holds(value) for value in values]
    if not sides[0] or sides[-1]:
        said = "holds" if sides[0] else "fails"
        raise NumericalFailure(
            f"no frontier between {values[0]:g} and {values[-1]:g}: the method {said} at both ends"
        )
    return _first(tried, values, sides, scale, tolerance)


def outwards(tried: Tried, values: Sequence[float], scale: Scale, tolerance: float) -> Frontier:
    """Find how far along `values` a method holds; it must hold at the first.

    Raises NumericalFailure otherwise.
    """
    sides = [tried.holds(value) for value in values]
    if not sides[0]:
        raise NumericalFailure(f"the remedy fails where the method does, at {values[0]:g}")
    if all(sides):
        return Frontier(values[-1], None, True, tried.points())
    return _first(tried, values, sides, scale, tolerance)


def _first(
    tried: Tried, values: Sequence[float], sides: Sequence[bool], scale: Scale, tolerance: float
) -> Frontier:
    """Bisect the first interval of `values` that changes sides, down to `tolerance`."""
    changes = sum(a != b for a, b in pairwise(sides))
    place = sides.index(False)
    good, bad = values[place - 1], values[place]
    while (half := scale.middle(good, bad, tolerance)) is not None:
        if tried.holds(half):
            good = half
        else:
            bad = half
    return Frontier(good, bad, changes == 1, tried.points())
