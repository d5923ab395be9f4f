"""Switching times of an expression of time: the sign changes of its margins.

Cells are halved until each certainly contains no root (its bounds, or those from its middle and its
slope, exclude zero) or at most one root (its slope keeps one sign).  No root is missed, however
narrow the feature that it bounds.  A root known only to rounding is given as the two numbers
between which the sign is undetermined.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array

from .enclosures import Enclosure
from .intervals import Interval, point

Margin = Callable[[Interval], Enclosure]

#: Initial number of cells, and the smallest cell as a fraction of the span.
_FIRST, _SMALLEST = 64, 2.0**-40

#: Bisection ends at a bracket of this fraction of the span, however near to zero its times are;
#: at most so many doublings then widen it until the sign is certain at its ends.
_CLOSED, _DOUBLINGS = 2.0**-64, 40


@dataclass(frozen=True)
class Roots:
    """Disjoint, ascending gaps (n, 2), s, that together contain every root.

    `complete` is False if there were too many cells; roots after `open_from` (s) may be missing.
    """

    gaps: Array
    complete: bool = True
    open_from: float = np.inf


def roots(margin: Margin, start: float, end: float, most: int = 2**16) -> Roots:
    """Find all sign changes of `margin` between start and end (s), with at most `most` cells."""
    edges = np.linspace(start, end, _FIRST + 1)
    a, b = edges[:-1], edges[1:]
    found: list[tuple[Array, Array]] = []
    smallest = _SMALLEST * (end - start)
    complete, open_from = True, np.inf
    while len(a):
        at, middle = margin(Interval(a, b)), a + (b - a) / 2
        mean = margin(point(middle)).value + at.slope * Interval(a - middle, b - middle)
        may = np.broadcast_to(at.value.meet(mean).meets_zero, a.shape)
        single = may & at.slope.is_one_sided
        found.append(_crossed(margin, a[single], b[single], _CLOSED * (end - start)))
        rest = may & ~single
        tiny = rest & (b - a <= np.maximum(smallest, 4 * np.spacing(np.abs(a))))
        found.append((a[tiny], b[tiny]))
        a, middle, b = (x[rest & ~tiny] for x in (a, middle, b))
        if sum(len(x) for x, _ in found) + 2 * len(a) > most:
            complete, open_from = False, float(min(a.min(initial=np.inf), end))
            break
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    left, right = (np.concatenate([pair[k] for pair in found]) for k in (0, 1))
    return Roots(_merged(left, right), complete, open_from)


def _at(margin: Margin, t: Array) -> Interval:
    value = margin(point(t)).value
    return Interval(np.broadcast_to(value.lo, t.shape), np.broadcast_to(value.hi, t.shape))


def _sign(value: Interval) -> NDArray[np.float64]:
    return np.asarray(np.sign(value.lo) + np.sign(value.hi))


def _crossed(margin: Margin, a: Array, b: Array, closed: float) -> tuple[Array, Array]:
    """Gaps around the roots of those cells in which the margin changes its sign once."""
    if not len(a):
        return a, b
    sides = _sign(_at(margin, a)), _sign(_at(margin, b))
    crosses = sides[0] * sides[1] <= 0
    a, b, left = a[crosses].copy(), b[crosses].copy(), sides[0][crosses]
    left = np.where(left == 0, -sides[1][crosses], left)
    while True:
        middle = a + (b - a) / 2
        inside = (middle > a) & (middle < b) & (b - a > closed)
        if not inside.any():
            break
        before = _sign(_at(margin, middle)) * left > 0
        a, b = np.where(inside & before, middle, a), np.where(inside & ~before, middle, b)
    return _opened(margin, a, -1.0), _opened(margin, b, 1.0)


def _opened(margin: Margin, t: Array, direction: float) -> Array:
    """Move times in one direction to the nearest found at which the margin's sign is certain."""
    moved, step = t.copy(), np.spacing(np.abs(t))
    for _ in range(_DOUBLINGS):
        doubtful = ~_at(margin, moved).is_one_sided
        if not doubtful.any():
            break
        moved, step = np.where(doubtful, t + direction * step, moved), 2 * step
    return moved


def _merged(a: Array, b: Array) -> Array:
    """Merge gaps that touch."""
    order = np.argsort(a)
    gaps: list[list[float]] = []
    for left, right in zip(a[order].tolist(), b[order].tolist(), strict=True):
        if gaps and left <= gaps[-1][1]:
            gaps[-1][1] = max(gaps[-1][1], right)
        else:
            gaps.append([left, right])
    return np.array(gaps).reshape(-1, 2)
