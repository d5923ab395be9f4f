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
NUMBERS_PER_PIECE = 5

#: A piece: c0 + c1 s + c2 s^2 + c3 s^3, where s = t - t0.
Piece = tuple[float, float, float, float, float]

INTERPOLATIONS = ("hold", "line", "cubic")

#: Largest jump that counts as rounding, relative to values above 1.
_MAX_ROUNDING_JUMP = 1e-12


@dataclass(frozen=True)
class PiecewisePolynomial:
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
    def is_constant(self) -> bool:
        """Whether the value is constant in time."""
        return not self.knots and not any(self.pieces[0][2:])

    def piece_at(self, t: float) -> Piece:
        """Piece that is valid at time t (s)."""
        return self.pieces[bisect_right(self.knots, t)]

    def value(self, t: float) -> float:
        """Value at time t (s)."""
        t0, c0, c1, c2, c3 = self.piece_at(t)
        s = t - t0
        return c0 + s * (c1 + s * (c2 + s * c3))


def discontinuities(number: PiecewisePolynomial) -> list[float]:
    """Knots at which the value or its rate jumps by more than rounding."""
    knots = []
    for knot, previous, following in zip(
        number.knots, number.pieces, number.pieces[1:], strict=False
    ):
        values = zip(_value_and_rate(previous, knot), _value_and_rate(following, knot), strict=True)
        if any(abs(b - a) > _MAX_ROUNDING_JUMP * max(1.0, abs(a), abs(b)) for a, b in values):
            knots.append(knot)
    return knots


def _value_and_rate(piece: Piece, t: float) -> tuple[float, float]:
    t0, c0, c1, c2, c3 = piece
    s = t - t0
    return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2 * c2 + s * 3 * c3)


def constant(value: float, rate: float = 0.0, second_rate: float = 0.0) -> PiecewisePolynomial:
    """Single piece for all times, from value, rate and second rate at t = 0."""
    return PiecewisePolynomial((), ((0.0, value, rate, second_rate / 2, 0.0),))


def interpolate(
    times: Sequence[float], values: Sequence[float], interpolation: str
) -> PiecewisePolynomial:
    """Interpolate values at ascending times (s): steps, lines or a cubic spline.

    "hold" keeps each value until the next time.  The cubic spline is twice continuously
    differentiable, with "not a knot" conditions at both ends (C. de Boor, A Practical Guide to
    Splines, Springer 1978, ch. IV).

    Lines and splines keep their rate up to and including the last time, so that a run that ends
    there still sees the rate.
    """
    pieces: list[Piece] = [(times[0], values[0], 0.0, 0.0, 0.0)]
    if interpolation == "hold":
        pieces += [(t, value, 0.0, 0.0, 0.0) for t, value in zip(times, values, strict=True)]
        return PiecewisePolynomial(tuple(times), tuple(pieces))
    derivatives = (
        _spline_derivatives(times, values) if interpolation == "cubic" and len(times) > 2 else None
    )
    for k in range(len(times) - 1):
        h = times[k + 1] - times[k]
        chord = (values[k + 1] - values[k]) / h
        a, b = (chord, chord) if derivatives is None else derivatives[k : k + 2]
        curvature = (a + b - 2 * chord) / h
        pieces.append((times[k], values[k], a, (chord - a) / h - curvature, curvature / h))
    pieces.append((times[-1], values[-1], 0.0, 0.0, 0.0))
    return PiecewisePolynomial((*times[:-1], math.nextafter(times[-1], math.inf)), tuple(pieces))


def _spline_derivatives(x: Sequence[float], y: Sequence[float]) -> list[float]:
    """Derivatives of the cubic spline at its three or more knots, from a tridiagonal system."""
    n = len(x)
    h = [b - a for a, b in pairwise(x)]
    d = [(b - a) / step for (a, b), step in zip(pairwise(y), h, strict=True)]
    if n == 3:  # one parabola
        curvature = (d[1] - d[0]) / (h[0] + h[1])
        return [d[0] - curvature * h[0], d[0] + curvature * h[0], d[1] + curvature * h[1]]
    first_span, last_span = h[0] + h[1], h[-1] + h[-2]
    below, diagonal, above = [0.0], [h[1]], [first_span]
    right_side = [((h[0] + 2 * first_span) * h[1] * d[0] + h[0] ** 2 * d[1]) / first_span]
    for i in range(1, n - 1):
        below.append(h[i])
        diagonal.append(2 * (h[i - 1] + h[i]))
        above.append(h[i - 1])
        right_side.append(3 * (h[i] * d[i - 1] + h[i - 1] * d[i]))
    below.append(last_span)
    diagonal.append(h[-2])
    right_side.append((h[-1] ** 2 * d[-2] + (2 * last_span + h[-1]) * h[-2] * d[-1]) / last_span)
    for i in range(1, n):
        factor = below[i] / diagonal[i - 1]
        diagonal[i] -= factor * above[i - 1]
        right_side[i] -= factor * right_side[i - 1]
    derivatives = [right_side[-1] / diagonal[-1]]
    for i in range(n - 2, -1, -1):
        derivatives.append((right_side[i] - above[i] * derivatives[-1]) / diagonal[i])
    return derivatives[::-1]
