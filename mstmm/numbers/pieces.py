"""Piecewise polynomials of time, as which signals and inputs are stored.

A piece is valid from its knot on, the knot included.  Before the first knot and after the last one
an interpolated quantity is constant.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

#: Numbers of a piece: t0, c0, c1, c2, c3.
COUNT = 5

#: A piece: c0 + c1 s + c2 s^2 + c3 s^3, where s = t - t0.
Piece = tuple[float, float, float, float, float]

INTERPOLATIONS = ("hold", "line", "cubic")

#: Largest jump that counts as rounding, relative to values above 1.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Pieces:
    """Piecewise polynomial of time with knots in s, ascending.

    `pieces[0]` is valid before the first knot, `pieces[k]` from knot k - 1 on.
    """

    knots: tuple[float, ...]
    pieces: tuple[Piece, ...]

    @property
    def varies(self) -> bool:
        """Whether there is more than one piece."""
        return bool(self.knots)

    @property
    def stands(self) -> bool:
        """Whether the value is constant in time."""
        return not self.knots and not any(self.pieces[0][2:])

    def at(self, t: float) -> Piece:
        """Piece that is valid at time t (s)."""
        return self.pieces[bisect_right(self.knots, t)]

    def value(self, t: float) -> float:
        """Value at time t (s)."""
        t0, c0, c1, c2, c3 = self.at(t)
        s = t - t0
        return c0 + s * (c1 + s * (c2 + s * c3))


def rough(number: Pieces) -> list[float]:
    """Knots at which the value or its rate jumps by more than rounding."""
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
    """Single piece for all times, from value, rate and second rate at t = 0."""
    return Pieces((), ((0.0, value, rate, second_rate / 2, 0.0),))


def through(times: Sequence[float], values: Sequence[float], interpolation: str) -> Pieces:
    """Interpolate values at ascending times (s): steps, lines or a cubic spline.

    "hold" keeps each value until the next time.  The cubic spline is twice continuously
    differentiable, with "not a knot" conditions at both ends (C. de Boor, A Practical Guide to
    Splines, Springer 1978, ch. IV).

    Lines and splines keep their rate up to and including the last time, so that a run that ends
    there still sees the rate.
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
    """Derivatives of the cubic spline at its three or more knots, from a tridiagonal system."""
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
