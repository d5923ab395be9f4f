"""The frontier between where a method holds and where it fails, by bisection."""

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
    """The two ends of the last bracket, and every (parameter, measured) on the way, in order.

    `fails_at` is None where nothing failed.  `monotone` is False where a coarse grid changes sides
    more than once: then the frontier is the first one that is met from the side that holds.
    """

    holds_at: float
    fails_at: float | None
    monotone: bool
    points: Points


class Tried:
    """A method's measured values by parameter, each computed once."""

    def __init__(self, measure: Callable[[float], float], limit: float) -> None:
        self._measure, self._limit = measure, limit
        self._found: dict[float, float] = {}

    def holds(self, value: float) -> bool:
        """Whether what is measured there is within the limit; no answer, or no number, is not."""
        if value not in self._found:
            try:
                found = float(self._measure(value))
            except NumericalFailure:
                found = math.inf
            self._found[value] = found if math.isfinite(found) else math.inf
        return self._found[value] <= self._limit

    def points(self) -> Points:
        """What was tried so far, in the order of the parameter."""
        return tuple(sorted(self._found.items()))


def bracketed(tried: Tried, values: Sequence[float], scale: Scale, tolerance: float) -> Frontier:
    """The frontier along `values`, of which the first must hold and the last must fail.

    Raises NumericalFailure where they do not.
    """
    sides = [tried.holds(value) for value in values]
    if not sides[0] or sides[-1]:
        said = "holds" if sides[0] else "fails"
        raise NumericalFailure(
            f"no frontier between {values[0]:g} and {values[-1]:g}: the method {said} at both"
        )
    return _first(tried, values, sides, scale, tolerance)


def outwards(tried: Tried, values: Sequence[float], scale: Scale, tolerance: float) -> Frontier:
    """How far along `values` a method holds, of which the first must.

    Raises NumericalFailure where that fails.
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
    """Halve the first step of `values` that changes sides until it is as short as `tolerance`."""
    changes = sum(a != b for a, b in pairwise(sides))
    place = sides.index(False)
    good, bad = values[place - 1], values[place]
    while (half := scale.middle(good, bad, tolerance)) is not None:
        if tried.holds(half):
            good = half
        else:
            bad = half
    return Frontier(good, bad, changes == 1, tried.points())
