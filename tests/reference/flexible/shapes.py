"""Shapes of a uniform beam on [0, 1] in the textbook form, with as many digits as it needs.

The hyperbolic pairs cancel beyond the tenth shape in double precision; here every value is formed
with 30 digits more than exp(beta) takes, so that no other form of the shapes is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import mpmath
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
#: f(xi, d): d-th derivative with respect to xi at the points xi.
Shape = Callable[[Array, int], Array]

#: sign of cos(beta) cosh(beta) in the frequency equation, and of the shape's trigonometric part.
_KINDS = {"clamped-free": (-1, -1), "free-free": (1, 1), "clamped-clamped": (1, -1)}


@cache
def root(kind: str, k: int) -> mpmath.mpf:
    """k-th positive root of cos(b) cosh(b) = -1 (clamped-free) or +1 (free-free), k = 1, 2, ..."""
    sign = _KINDS[kind][0]
    guess = (k - mpmath.mpf(1) / 2) * mpmath.pi if sign < 0 else (k + mpmath.mpf(1) / 2) * mpmath.pi
    with mpmath.workdps(60 + 2 * k):
        if sign < 0 and k == 1:
            guess = mpmath.mpf("1.875")
        return mpmath.findroot(lambda b: mpmath.cos(b) - sign / mpmath.cosh(b), guess)


@cache
def _values(kind: str, k: int, points: tuple[float, ...], order: int) -> Array:
    with mpmath.workdps(60 + 2 * k):
        b, part = root(kind, k), _KINDS[kind][1]
        c, s, ch, sh = mpmath.cos(b), mpmath.sin(b), mpmath.cosh(b), mpmath.sinh(b)
        sign = 1 if kind == "clamped-free" else -1
        ratio = (ch + sign * c) / (sh + sign * s)
        out = []
        for x in points:
            z = b * mpmath.mpf(x)
            hyperbolic = mpmath.cosh(z) - ratio * mpmath.sinh(z)
            if order % 2:
                hyperbolic = mpmath.sinh(z) - ratio * mpmath.cosh(z)
            angle = z + order * mpmath.pi / 2
            circular = mpmath.cos(angle) - ratio * mpmath.sin(angle)
            out.append(float(b**order * (hyperbolic + part * circular)))
    return np.array(out)


def vibration(kind: str, k: int) -> Shape:
    """k-th elastic shape of a free vibration; its mean square over [0, 1] is one."""

    def shape(xi: Array, order: int = 0) -> Array:
        return _values(kind, k, tuple(float(v) for v in np.ravel(xi)), order).reshape(np.shape(xi))

    return shape


def sine(k: int) -> Shape:
    """k-th shape of a simply supported beam."""

    def shape(xi: Array, order: int = 0) -> Array:
        w = k * np.pi
        return np.sqrt(2) * w**order * np.sin(w * np.asarray(xi, float) + order * np.pi / 2)

    return shape


def quarter_sine(k: int) -> Shape:
    """k-th shape of a rod in twist or extension, held at 0 and free at 1."""

    def shape(xi: Array, order: int = 0) -> Array:
        w = (k - 0.5) * np.pi
        return np.sqrt(2) * w**order * np.sin(w * np.asarray(xi, float) + order * np.pi / 2)

    return shape


def cosine(k: int) -> Shape:
    """k-th elastic shape of a rod free at both ends."""

    def shape(xi: Array, order: int = 0) -> Array:
        w = k * np.pi
        return np.sqrt(2) * w**order * np.cos(w * np.asarray(xi, float) + order * np.pi / 2)

    return shape


def polynomial(*coefficients: float) -> Shape:
    """c0 + c1 xi + c2 xi^2 + ..."""

    def shape(xi: Array, order: int = 0) -> Array:
        derived = np.polynomial.Polynomial(coefficients).deriv(order)
        return np.asarray(derived(np.asarray(xi, float)), float)

    return shape
