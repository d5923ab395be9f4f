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

from mstmm.arrays import Array

from .enclosures import Enclosure
from .intervals import Interval

#: A function changes over a cell by at most this fraction of its change over the run.
PART = 0.25

#: Cells, and radians of a uniform oscillation, that a step may span: a pulse is then wider than the
#: widest gap between the stages of any method.
CELLS, TURN = 8.0, 6.0

#: An oscillation is uniform if its lowest rate is at least this fraction of its highest rate.
_EVEN = 0.5

#: Smallest cell, smallest cell around a pole, and shortest step limit, as fractions of the span.
_SMALLEST, _POLE, _SHORTEST = 2.0**-40, 2.0**-6, 2.0**-37

#: Changes up to _TINY, or up to _FLAT of the value, are rounding.  Cells longer than the fraction
#: _LONG of the span do not limit the step.
_TINY, _FLAT, _LONG = 1e-290, 1e-9, 1 / 32


@dataclass(frozen=True)
class Watched:
    """Function in an expression whose narrow features limit the step.

    `term` is the index of its term; `slope` says whether its value or its derivative is watched;
    `argument` is the index of the argument of a sine or cosine.
    """

    term: int
    argument: int | None = None
    slope: bool = False


@dataclass(frozen=True)
class Pace:
    """Longest steps (n,), s, valid from the times `starts` (n,), s, each up to the next one.

    `complete` is False if the limit on the number of cells ended the subdivision.
    """

    starts: Array
    longest: Array
    complete: bool = True


Terms = Callable[[Interval], dict[int, Enclosure]]


def pace(
    terms: Terms, watched: Sequence[Watched], start: float, end: float, most: int = 2**16,
    edges: Array | None = None,
) -> Pace:  # fmt: skip
    """Longest steps from start to end (s) for the watched functions, from at most `most` cells.

    No cell contains one of the `edges` (n,) in its interior; they ascend from start to end.
    """
    bare = np.array([start, end]) if edges is None else edges
    a, b = bare[:-1], bare[1:]
    lo, hi, even = _looked_at(terms, watched, a, b)
    complete = True
    while True:
        coarse = _coarse(lo, hi, even, (b - a) / (end - start))
        if not coarse.any():
            break
        if len(a) + coarse.sum() > most:
            complete = False
            break
        middle = a[coarse] + (b[coarse] - a[coarse]) / 2
        halves = np.concatenate([a[coarse], middle]), np.concatenate([middle, b[coarse]])
        new = _looked_at(terms, watched, *halves)
        a, b = np.concatenate([a[~coarse], halves[0]]), np.concatenate([b[~coarse], halves[1]])
        lo, hi, even = (np.concatenate([old[:, ~coarse], part], axis=1)
                        for old, part in zip((lo, hi, even), new, strict=True))  # fmt: skip
    order = np.argsort(a)
    longest = np.where(b - a <= _LONG * (end - start), CELLS * (b - a), np.inf)
    longest = np.minimum(longest, even.min(axis=0, initial=np.inf))
    longest = np.maximum(longest, _SHORTEST * (end - start))
    return _joined(a[order], longest[order], complete)


def _looked_at(
    terms: Terms, watched: Sequence[Watched], a: Array, b: Array
) -> tuple[Array, Array, Array]:
    """Lower bounds, upper bounds, longest steps of uniform oscillations, each (watched, cells)."""
    known = terms(Interval(a, b))
    lo, hi = np.empty((len(watched), len(a))), np.empty((len(watched), len(a)))
    even = np.full((len(watched), len(a)), np.inf)
    for row, one in enumerate(watched):
        bounds = known[one.term].slope if one.slope else known[one.term].value
        lo[row], hi[row] = bounds.lo, bounds.hi
        if one.argument is not None:
            slope = known[one.argument].slope
            fastest = np.maximum(np.abs(slope.lo), np.abs(slope.hi))
            is_even = np.minimum(np.abs(slope.lo), np.abs(slope.hi)) >= _EVEN * fastest
            even[row] = np.where(is_even & slope.is_one_sided, TURN / fastest, np.inf)
    return lo, hi, even


def _coarse(lo: Array, hi: Array, even: Array, size: Array) -> NDArray[np.bool_]:
    """Mask (cells,) of the cells to be halved; `size` is each cell's fraction of the span."""
    finite = np.isfinite(lo) & np.isfinite(hi)
    least = np.min(lo, axis=1, where=finite, initial=np.inf)[:, None]
    most = np.max(hi, axis=1, where=finite, initial=-np.inf)[:, None]
    change = most - least
    flat = change <= np.maximum(_TINY, _FLAT * np.maximum(np.abs(most), np.abs(least)))
    varies = finite & (hi - lo > PART * change) & ~flat & np.isinf(even) & (size > _SMALLEST)
    beyond = ~finite & ~np.isnan(lo) & (size > _POLE)
    return np.asarray((varies | beyond).any(axis=0))


def _joined(starts: Array, longest: Array, complete: bool) -> Pace:
    """Merge neighbouring cells whose limits are in the same octave; the smaller limit holds."""
    octave = np.floor(np.log2(longest, out=np.full(len(longest), np.inf), where=longest < np.inf))
    first = np.append(True, octave[1:] != octave[:-1])
    return Pace(starts[first], np.minimum.reduceat(longest, np.flatnonzero(first)), complete)
