"""Truncated Taylor arithmetic in time: a value with its first and second derivative.

Positions written once in jets give velocities and accelerations exactly, so that no motion
subspace or bias formula has to be stated by hand.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


class Jet:
    """Arrays `x`, `dx`, `ddx` of one shape: value, first and second time derivative."""

    __array_priority__ = 100.0
    __slots__ = ("ddx", "dx", "x")

    def __init__(self, x: Any, dx: Any = 0.0, ddx: Any = 0.0) -> None:
        self.x = np.asarray(x, float)
        shape = self.x.shape
        self.dx, self.ddx = np.asarray(dx, float), np.asarray(ddx, float)
        if self.dx.shape != shape or self.ddx.shape != shape:
            parts = np.broadcast_arrays(self.x, self.dx, self.ddx)
            self.x, self.dx, self.ddx = parts

    def __getitem__(self, key: Any) -> Jet:
        return Jet(self.x[key], self.dx[key], self.ddx[key])

    def __neg__(self) -> Jet:
        return Jet(-self.x, -self.dx, -self.ddx)

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.x + other, self.dx, self.ddx)
        return Jet(self.x + other.x, self.dx + other.dx, self.ddx + other.ddx)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Any) -> Jet:
        return -self + other

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.x * other, self.dx * other, self.ddx * other)
        return _bilinear(np.multiply, self, other)

    __rmul__ = __mul__

    def __matmul__(self, other: Any) -> Jet:
        return _bilinear(np.matmul, self, as_jet(other))

    def __rmatmul__(self, other: Any) -> Jet:
        return _bilinear(np.matmul, as_jet(other), self)

    def __truediv__(self, other: Any) -> Jet:
        return self * chain(as_jet(other), lambda v: (1 / v, -1 / v**2, 2 / v**3))

    @property
    def transpose(self) -> Jet:
        """Last two axes exchanged."""
        return Jet(*(np.swapaxes(part, -1, -2) for part in (self.x, self.dx, self.ddx)))


def as_jet(value: Any) -> Jet:
    """A number or array as a jet that does not move."""
    return value if isinstance(value, Jet) else Jet(value)


def _bilinear(product: Any, a: Jet, b: Jet) -> Jet:
    return Jet(
        product(a.x, b.x),
        product(a.dx, b.x) + product(a.x, b.dx),
        product(a.ddx, b.x) + 2 * product(a.dx, b.dx) + product(a.x, b.ddx),
    )


def chain(a: Jet, function: Any) -> Jet:
    """f(a) from a function that returns f, f', f'' at a value."""
    f, df, ddf = function(a.x)
    return Jet(f, df * a.dx, df * a.ddx + ddf * a.dx**2)


def sin(a: Jet) -> Jet:
    """Sine."""
    return chain(a, lambda v: (np.sin(v), np.cos(v), -np.sin(v)))


def cos(a: Jet) -> Jet:
    """Cosine."""
    return chain(a, lambda v: (np.cos(v), -np.sin(v), -np.cos(v)))


def sqrt(a: Jet) -> Jet:
    """Square root."""
    return chain(a, lambda v: (np.sqrt(v), 0.5 / np.sqrt(v), -0.25 / np.sqrt(v) ** 3))


def atan2(y: Jet, x: Jet) -> Jet:
    """Angle of (x, y); its derivatives do not depend on the branch."""
    radius = x.x**2 + y.x**2
    rate = (x.x * y.dx - y.x * x.dx) / radius
    turn = (x.x * y.ddx - y.x * x.ddx) / radius
    return Jet(np.arctan2(y.x, x.x), rate, turn - 2 * rate * (x.x * x.dx + y.x * y.dx) / radius)


def dot(a: Any, b: Any) -> Jet:
    """Inner product over the last axis."""
    product = as_jet(a) * as_jet(b)
    return Jet(product.x.sum(-1), product.dx.sum(-1), product.ddx.sum(-1))


def apply(matrix: Any, vector: Any) -> Jet:
    """Matrix times vector over the last axes."""
    return (as_jet(matrix) @ as_jet(vector)[..., None])[..., 0]


def stack(parts: list[Jet]) -> Jet:
    """Scalars to a vector along a new last axis."""
    return Jet(*(np.stack([getattr(p, n) for p in parts], axis=-1) for n in ("x", "dx", "ddx")))


def join(parts: list[Jet]) -> Jet:
    """Vectors one after the other along the last axis."""
    return Jet(*(np.concatenate([getattr(p, n) for p in parts], -1) for n in ("x", "dx", "ddx")))
