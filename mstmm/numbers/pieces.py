"""A number that changes with time as polynomials, piece by piece: what signals and inputs are.

At its knots one piece ends and the next begins, which holds there already.  Before the first knot
and behind the last one the number stands still.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

#: How many numbers a piece has: t0, c0, c1, c2, c3.
COUNT = 5

#: A piece: c0 + c1 s + c2 s^2 + c3 s^3, where s = t - t0.
Piece = tuple[float, float, float, float, float]

INTERPOLATIONS = ("hold", "line", "cubic")

#: What jumps by less than this, of numbers above 1 relatively, does not.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Pieces:
    """`pieces[0]` before the first of the knots (s, ascending), `pieces[k]` from knot k - 1 on."""

    knots: tuple[float, ...]
    pieces: tuple[Piece, ...]

    @property
    def varies(self) -> bool:
        """Whether it is more than one piece."""
        return bool(self.knots)

    @property
    def stands(self) -> bool:
        """Whether it is one number at all times."""
        return not self.knots and not any(self.pieces[0][2:])

    def at(self, t: float) -> Piece:
        """The piece that holds at t."""
        return self.pieces[bisect_right(self.knots, t)]

    def value(self, t: float) -> float:
        """The number at t."""
        t0, c0, c1, c2, c3 = self.at(t)
        s = t - t0
        return c0 + s * (c1 + s * (c2 + s * c3))


def rough(number: Pieces) -> list[float]:
    """The knots at which the number or its rate jumps, but for rounding."""
    found = []
    for knot, before, behind in zip(number.knots, number.pieces, number.pieces[1:], strict=False):
        ends = zip(_value_and_rate(before, knot), _value_and_rate(behind, knot), strict=True)
        if any(abs(b - a) > _ROUNDING * max(1.0, abs(a), abs(b)) for a, b in ends):
            found.append(knot)
    return found


def _value_and_rate(piece: Piece, t: float) -> tuple[float, float]:
    t0, c0, c1, c2, c3 = piece
    s = t - t0
    return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + s * 3 * c3)


def steady(value: float, rate: float = 0.0, second_rate: float = 0.0) -> Pieces:
    """One piece for all times: a number at t = 0, its rate and the rate of that."""
    return Pieces((), ((0.0, value, rate, second_rate / 2, 0.0),))


def through(times: Sequence[float], values: Sequence[float], interpolation: str) -> Pieces:
    """The number that has these values at these times (ascending): each held up to the next, on
    lines, or on a cubic spline (twice continuously differentiable, "not a knot" at both ends: C. de
    Boor, A Practical Guide to Splines, Springer 1978, ch. IV).

    A line or a spline keeps its rate up to and at the last of the times: what ends there with it
    has not stopped.
    """
    made: list[Piece] = [(times[0], values[0], 0.0, 0.0, 0.0)]
    if interpolation == "hold":
        made += [(t, value, 0.0, 0.0, 0.0) for t, value in zip(times, values, strict=True)]
        return Pieces(tuple(times), tuple(made))
    slopes = _slopes(times, values) if interpolation == "cubic" and len(times) > 2 else None
    for k in range(len(times) - 1):
        h = times[k + 1] - times[k]
        chord = (values[k + 1] - values[k]) / h
        a, b = (chord, chord) if slopes is None else slopes[k : k + 2]
        bend = (a + b - 2 * chord) / h
        made.append((times[k], values[k], a, (chord - a) / h - bend, bend / h))
    made.append((times[-1], values[-1], 0.0, 0.0, 0.0))
    return Pieces((*times[:-1], math.nextafter(times[-1], math.inf)), tuple(made))


def _slopes(x: Sequence[float], y: Sequence[float]) -> list[float]:
    """Slopes of the cubic spline at its knots, three or more: a tridiagonal system."""
    n = len(x)
    h = [b - a for a, b in pairwise(x)]
    d = [(b - a) / step for (a, b), step in zip(pairwise(y), h, strict=True)]
    if n == 3:  # one parabola
        bend = (d[1] - d[0]) / (h[0] + h[1])
        return [d[0] - bend * h[0], d[0] + bend * h[0], d[1] + bend * h[1]]
    first, last = h[0] + h[1], h[-1] + h[-2]
    below, diagonal, above = [0.0], [h[1]], [first]
    right = [((h[0] + 2 * first) * h[1] * d[0] + h[0] ** 2 * d[1]) / first]
    for i in range(1, n - 1):
        below.append(h[i])
        diagonal.append(2 * (h[i - 1] + h[i]))
        above.append(h[i - 1])
        right.append(3 * (h[i] * d[i - 1] + h[i - 1] * d[i]))
    below.append(last)
    diagonal.append(h[-2])
    right.append((h[-1] ** 2 * d[-2] + (2 * last + h[-1]) * h[-2] * d[-1]) / last)
    for i in range(1, n):
        share = below[i] / diagonal[i - 1]
        diagonal[i] -= share * above[i - 1]
        right[i] -= share * right[i - 1]
    found = [right[-1] / diagonal[-1]]
    for i in range(n - 2, -1, -1):
        found.append((right[i] - above[i] * found[-1]) / diagonal[i])
    return found[::-1]
