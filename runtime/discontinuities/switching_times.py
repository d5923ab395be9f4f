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

from mstmm.array_validation import Array

from .interval_arithmetic import Interval, as_interval
from .interval_enclosures import Enclosure

Margin = Callable[[Interval], Enclosure]

#: Initial number of cells, and the smallest cell as a fraction of the span.
_INITIAL_CELLS, _SMALLEST_CELL = 64, 2.0**-40

#: Bisection ends at a bracket of this fraction of the span, however near to zero its times are;
#: at most so many doublings then widen it until the sign is certain at its ends.
_CLOSED_BRACKET, _MAX_DOUBLINGS = 2.0**-64, 40


@dataclass(frozen=True)
class Roots:
    """Disjoint, ascending gaps (n, 2), s, that together contain every root.

    `complete` is False if there were too many cells; roots after `open_from` (s) may be missing.
    """

    gaps: Array
    complete: bool = True
    open_from: float = np.inf


def find_roots(margin: Margin, start: float, end: float, most: int = 2**16) -> Roots:
    """Find all sign changes of `margin` between start and end (s), with at most `most` cells."""
    edges = np.linspace(start, end, _INITIAL_CELLS + 1)
    a, b = edges[:-1], edges[1:]
    brackets: list[tuple[Array, Array]] = []
    smallest = _SMALLEST_CELL * (end - start)
    is_complete, incomplete_from = True, np.inf
    while len(a):
        enclosure, middle = margin(Interval(a, b)), a + (b - a) / 2
        mean_value_bounds = margin(as_interval(middle)).value + enclosure.slope * Interval(
            a - middle, b - middle
        )
        may_contain_root = np.broadcast_to(
            enclosure.value.intersect(mean_value_bounds).contains_zero, a.shape
        )
        has_single_root = may_contain_root & enclosure.slope.is_one_sided
        brackets.append(
            _bracket_crossings(
                margin, a[has_single_root], b[has_single_root], _CLOSED_BRACKET * (end - start)
            )
        )
        is_open = may_contain_root & ~has_single_root
        is_smallest = is_open & (b - a <= np.maximum(smallest, 4 * np.spacing(np.abs(a))))
        brackets.append((a[is_smallest], b[is_smallest]))
        a, middle, b = (x[is_open & ~is_smallest] for x in (a, middle, b))
        if sum(len(x) for x, _ in brackets) + 2 * len(a) > most:
            is_complete, incomplete_from = False, float(min(a.min(initial=np.inf), end))
            break
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    left, right = (np.concatenate([pair[k] for pair in brackets]) for k in (0, 1))
    return Roots(_merge_gaps(left, right), is_complete, incomplete_from)


def _margin_at(margin: Margin, t: Array) -> Interval:
    value = margin(as_interval(t)).value
    return Interval(np.broadcast_to(value.lo, t.shape), np.broadcast_to(value.hi, t.shape))


def _margin_sign(value: Interval) -> NDArray[np.float64]:
    return np.asarray(np.sign(value.lo) + np.sign(value.hi))


def _bracket_crossings(margin: Margin, a: Array, b: Array, closed: float) -> tuple[Array, Array]:
    """Gaps around the roots of those cells in which the margin changes its sign once."""
    if not len(a):
        return a, b
    end_signs = _margin_sign(_margin_at(margin, a)), _margin_sign(_margin_at(margin, b))
    has_crossing = end_signs[0] * end_signs[1] <= 0
    a, b, left_sign = a[has_crossing].copy(), b[has_crossing].copy(), end_signs[0][has_crossing]
    left_sign = np.where(left_sign == 0, -end_signs[1][has_crossing], left_sign)
    while True:
        middle = a + (b - a) / 2
        is_open = (middle > a) & (middle < b) & (b - a > closed)
        if not is_open.any():
            break
        is_left = _margin_sign(_margin_at(margin, middle)) * left_sign > 0
        a, b = np.where(is_open & is_left, middle, a), np.where(is_open & ~is_left, middle, b)
    return _move_to_certain_sign(margin, a, -1.0), _move_to_certain_sign(margin, b, 1.0)


def _move_to_certain_sign(margin: Margin, t: Array, direction: float) -> Array:
    """Move times in one direction to the nearest found at which the margin's sign is certain."""
    times, step = t.copy(), np.spacing(np.abs(t))
    for _ in range(_MAX_DOUBLINGS):
        is_uncertain = ~_margin_at(margin, times).is_one_sided
        if not is_uncertain.any():
            break
        times, step = np.where(is_uncertain, t + direction * step, times), 2 * step
    return times


def _merge_gaps(a: Array, b: Array) -> Array:
    """Merge gaps that touch."""
    order = np.argsort(a)
    gaps: list[list[float]] = []
    for left, right in zip(a[order].tolist(), b[order].tolist(), strict=True):
        if gaps and left <= gaps[-1][1]:
            gaps[-1][1] = max(gaps[-1][1], right)
        else:
            gaps.append([left, right])
    return np.array(gaps).reshape(-1, 2)
