"""Longest steps that cannot miss a narrow feature of an expression of time.

Cells of time are halved until every function in the expression changes over each cell by at most a
fraction of its total change over the run.  Short cells then cover a pulse, and long cells the time
far from it.  A step may span a few of its cells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .interval_arithmetic import Interval
from .interval_enclosures import Enclosure

#: A function changes over a cell by at most this fraction of its change over the run.
MAX_CELL_CHANGE = 0.25

#: Cells, and radians of a uniform oscillation, that a step may span: a pulse is then wider than the
#: widest gap between the stages of any method.
CELLS_PER_STEP, MAX_STEP_ANGLE = 8.0, 6.0

#: An oscillation is uniform if its lowest rate is at least this fraction of its highest rate.
_MIN_RATE_RATIO = 0.5

#: Smallest cell, smallest cell around a pole, and shortest step limit, as fractions of the span.
_SMALLEST_CELL, _SMALLEST_POLE_CELL, _SHORTEST_LIMIT = 2.0**-40, 2.0**-6, 2.0**-37

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
