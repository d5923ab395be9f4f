"""Switching times and longest steps of expressions of time, by subdivision of cells of time.

For switching times, the sign changes of margins, cells are halved until each certainly contains no
root (its bounds, or those from its middle and its slope, exclude zero) or at most one root (its
slope keeps one sign).  No root is missed, however narrow the feature that it bounds.  A root known
only to rounding is given as the two numbers between which the sign is undetermined.

For longest steps, which cannot miss a narrow feature, cells are halved until every function in the
expression changes over each cell by at most a fraction of its total change over the run.  Short
cells then cover a pulse, and long cells the time far from it.  A step may span a few of its cells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .interval_enclosures import Enclosure, Interval, as_interval

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


#: A function changes over a cell by at most this fraction of its change over the run.
MAX_CELL_CHANGE = 0.25

#: Cells, and radians of a uniform oscillation, that a step may span: a pulse is then wider than the
#: widest gap between the stages of any method.
CELLS_PER_STEP, MAX_STEP_ANGLE = 8.0, 6.0

#: An oscillation is uniform if its lowest rate is at least this fraction of its highest rate.
_MIN_RATE_RATIO = 0.5

#: Smallest cell around a pole, and shortest step limit, as fractions of the span.
_SMALLEST_POLE_CELL, _SHORTEST_LIMIT = 2.0**-6, 2.0**-37

#: Changes up to _TINY, or up to _FLAT of the value, are rounding.  Cells longer than the fraction
#: _LONG of the span do not limit the step.
_NEGLIGIBLE_CHANGE, _RELATIVE_ROUNDING, _UNBOUNDED_CELL = 1e-290, 1e-9, 1 / 32


@dataclass(frozen=True)
class WatchedFunction:
    """Function in an expression whose narrow features limit the step.

    `term` is the index of its term; `slope` says whether its value or its derivative is watched;
    `argument` is the index of the argument of a sine or cosine.
    """

    term: int
    argument: int | None = None
    slope: bool = False


@dataclass(frozen=True)
class StepLimits:
    """Longest steps (n,), s, valid from the times `starts` (n,), s, each up to the next one.

    `complete` is False if the limit on the number of cells ended the subdivision.
    """

    starts: Array
    longest: Array
    complete: bool = True


TermEnclosures = Callable[[Interval], dict[int, Enclosure]]


def step_limits(
    terms: TermEnclosures,
    watched: Sequence[WatchedFunction],
    start: float,
    end: float,
    most: int = 2**16,
    edges: Array | None = None,
) -> StepLimits:
    """Longest steps from start to end (s) for the watched functions, from at most `most` cells.

    No cell contains one of the `edges` (n,) in its interior; they ascend from start to end.
    """
    boundaries = np.array([start, end]) if edges is None else edges
    a, b = boundaries[:-1], boundaries[1:]
    lower, upper, uniform_limits = _bounds_over_cells(terms, watched, a, b)
    is_complete = True
    while True:
        is_coarse = _is_coarse(lower, upper, uniform_limits, (b - a) / (end - start))
        if not is_coarse.any():
            break
        if len(a) + is_coarse.sum() > most:
            is_complete = False
            break
        middle = a[is_coarse] + (b[is_coarse] - a[is_coarse]) / 2
        halves = np.concatenate([a[is_coarse], middle]), np.concatenate([middle, b[is_coarse]])
        half_bounds = _bounds_over_cells(terms, watched, *halves)
        a, b = (
            np.concatenate([a[~is_coarse], halves[0]]),
            np.concatenate([b[~is_coarse], halves[1]]),
        )
        lower, upper, uniform_limits = (
            np.concatenate([previous[:, ~is_coarse], part], axis=1)
            for previous, part in zip((lower, upper, uniform_limits), half_bounds, strict=True)
        )
    order = np.argsort(a)
    longest = np.where(b - a <= _UNBOUNDED_CELL * (end - start), CELLS_PER_STEP * (b - a), np.inf)
    longest = np.minimum(longest, uniform_limits.min(axis=0, initial=np.inf))
    longest = np.maximum(longest, _SHORTEST_LIMIT * (end - start))
    return _merge_limits(a[order], longest[order], is_complete)


def _bounds_over_cells(
    terms: TermEnclosures, watched: Sequence[WatchedFunction], a: Array, b: Array
) -> tuple[Array, Array, Array]:
    """Lower bounds, upper bounds, longest steps of uniform oscillations, each (watched, cells)."""
    enclosures = terms(Interval(a, b))
    lower, upper = np.empty((len(watched), len(a))), np.empty((len(watched), len(a)))
    uniform_limits = np.full((len(watched), len(a)), np.inf)
    for row, function in enumerate(watched):
        bounds = (
            enclosures[function.term].slope if function.slope else enclosures[function.term].value
        )
        lower[row], upper[row] = bounds.lo, bounds.hi
        if function.argument is not None:
            slope = enclosures[function.argument].slope
            fastest = np.maximum(np.abs(slope.lo), np.abs(slope.hi))
            is_even = np.minimum(np.abs(slope.lo), np.abs(slope.hi)) >= _MIN_RATE_RATIO * fastest
            uniform_limits[row] = np.where(
                is_even & slope.is_one_sided, MAX_STEP_ANGLE / fastest, np.inf
            )
    return lower, upper, uniform_limits


def _is_coarse(lo: Array, hi: Array, even: Array, size: Array) -> NDArray[np.bool_]:
    """Mask (cells,) of the cells to be halved; `size` is each cell's fraction of the span."""
    is_finite = np.isfinite(lo) & np.isfinite(hi)
    minimum = np.min(lo, axis=1, where=is_finite, initial=np.inf)[:, None]
    maximum = np.max(hi, axis=1, where=is_finite, initial=-np.inf)[:, None]
    change = maximum - minimum
    is_constant = change <= np.maximum(
        _NEGLIGIBLE_CHANGE, _RELATIVE_ROUNDING * np.maximum(np.abs(maximum), np.abs(minimum))
    )
    varies = (
        is_finite
        & (hi - lo > MAX_CELL_CHANGE * change)
        & ~is_constant
        & np.isinf(even)
        & (size > _SMALLEST_CELL)
    )
    is_unbounded = ~is_finite & ~np.isnan(lo) & (size > _SMALLEST_POLE_CELL)
    return np.asarray((varies | is_unbounded).any(axis=0))


def _merge_limits(starts: Array, longest: Array, complete: bool) -> StepLimits:
    """Merge neighbouring cells whose limits are in the same octave; the smaller limit holds."""
    octave = np.floor(np.log2(longest, out=np.full(len(longest), np.inf), where=longest < np.inf))
    is_first = np.append(True, octave[1:] != octave[:-1])
    return StepLimits(
        starts[is_first], np.minimum.reduceat(longest, np.flatnonzero(is_first)), complete
    )
