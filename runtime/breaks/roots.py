"""Every time at which an expression of time switches: where a margin changes its sign.

Cells are halved until each holds no root for sure (its bounds, or those from its middle and its
slope, miss zero) or at most one (its slope keeps one sign), so that no root is missed however
narrow what it bounds.  A root that is known only
to rounding is given as the two numbers between which the sign is open.
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

#: Cells at the start, and the smallest one as part of the span.
_FIRST, _SMALLEST = 64, 2.0**-40

#: A bracket as short as this part of the span is closed, however near to zero it lies; doublings
#: open it again to where the sign is known.
_CLOSED, _DOUBLINGS = 2.0**-64, 40


@dataclass(frozen=True)
class Roots:
    """Gaps (n, 2), ascending and apart, that hold every root; `complete` is False where there were
    too many cells, with `open_from` the first time that is not known."""

    gaps: Array
    complete: bool = True
    open_from: float = np.inf


def roots(margin: Margin, start: float, end: float, most: int = 2**16) -> Roots:
    """All sign changes of `margin` between start and end (s), from `most` cells at most."""
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
    """Gaps around the roots of the cells in which the margin changes its sign, once."""
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
    """The nearest numbers found on that side at which the sign of the margin is beyond doubt."""
    moved, step = t.copy(), np.spacing(np.abs(t))
    for _ in range(_DOUBLINGS):
        doubtful = ~_at(margin, moved).is_one_sided
        if not doubtful.any():
            break
        moved, step = np.where(doubtful, t + direction * step, moved), 2 * step
    return moved


def _merged(a: Array, b: Array) -> Array:
    """Gaps that touch are one."""
    order = np.argsort(a)
    gaps: list[list[float]] = []
    for left, right in zip(a[order].tolist(), b[order].tolist(), strict=True):
        if gaps and left <= gaps[-1][1]:
            gaps[-1][1] = max(gaps[-1][1], right)
        else:
            gaps.append([left, right])
    return np.array(gaps).reshape(-1, 2)
