"""Potential energy of Kirchhoff's rod in polynomials of a rotation vector, and nothing else.

    R(s) = exp [v(s)],   v(0) = 0,   Pi = 1/2 int u . K u ds - F . int R e_x ds.

Dead force at the tip.  Gradient by complex steps, second derivative by differences of it: no
equation of balance is written, so that `kirchhoff` is checked by another principle.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

Array = npt.NDArray[np.float64]
E_X = np.array([1.0, 0.0, 0.0])


class Ritz:
    """`order` + 1 polynomials for every component of v; stiffness (3,): GJ, EI_y, EI_z."""

    def __init__(self, stiffness: Array, length: float, order: int) -> None:
        x, weight = legendre.leggauss(order + 10)
        self.places = s = length * (x + 1) / 2
        self.stiffness, self.weight = stiffness, length * weight / 2
        values = legendre.legvander(x, order)
        rates = np.array([legendre.legval(x, legendre.legder(row)) for row in np.eye(order + 1)])
        self.shapes = s[:, None] * values
        self.slopes = values + s[:, None] * rates.T * (2 / length)
        self.length, self.size = length, 3 * (order + 1)

    def tip(self, a: Any) -> Any:
        """Place (..., 3) for coefficients (..., size)."""
        v = self._vectors(self.shapes, a)
        f, g, _ = _series((v * v).sum(-1))
        tangent = E_X + f * np.cross(v, E_X) + g * np.cross(v, np.cross(v, E_X))
        return self.weight @ tangent

    def rotation(self, a: Array) -> Array:
        """Rotation vector (3,) of the tip."""
        return self.length * a.reshape(-1, 3).sum(0)

    def potential(self, a: Any, force: Array) -> Any:
        """Of strain and of the force (...)."""
        v, rate = self._vectors(self.shapes, a), self._vectors(self.slopes, a)
        _, g, h = _series((v * v).sum(-1))
        own = rate - g * np.cross(v, rate) + h * np.cross(v, np.cross(v, rate))
        return 0.5 * (own * own @ self.stiffness) @ self.weight - self.tip(a) @ force

    def gradient(self, a: Array, force: Array) -> Array:
        """Derivative (size,) of the potential."""
        steps = a + 1e-30j * np.eye(self.size)
        return np.asarray(self.potential(steps, force).imag / 1e-30, float)

    def equilibrium(self, force: Array, start: Array) -> Array:
        """Coefficients (size,) near `start` where the potential is stationary (Newton)."""
        a = start
        for _ in range(12):
            step = np.linalg.solve(self.hessian(a, force), self.gradient(a, force))
            a = a - step
            if np.abs(step).max() < 1e-12:
                break
        return np.asarray(a, float)

    def fitted_coefficients(self, vectors: Array) -> Array:
        """Coefficients (size,) of rotation vectors (places, 3)."""
        return np.asarray(np.linalg.lstsq(self.shapes, vectors)[0].ravel(), float)

    def hessian(self, a: Array, force: Array, step: float = 1e-5) -> Array:
        """Second derivative (size, size)."""
        rows = [
            self.gradient(a + step * e, force) - self.gradient(a - step * e, force)
            for e in np.eye(self.size)
        ]
        return np.array(rows) / (2 * step)

    def _vectors(self, basis: Array, a: Any) -> Any:
        return basis @ a.reshape(*a.shape[:-1], -1, 3)


def _series(square: Any) -> tuple[Any, Any, Any]:
    """sin x / x, (1 - cos x) / x^2 and (x - sin x) / x^3 with a last axis; x must not vanish."""
    x = np.sqrt(square)[..., None]
    return np.sin(x) / x, (1 - np.cos(x)) / x**2, (x - np.sin(x)) / x**3
