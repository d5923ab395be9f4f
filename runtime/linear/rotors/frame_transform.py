"""Transformation of linear equations from rotating to fixed frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from mstmm.array_validation import Array

from ..mck_matrices import Matrices


@dataclass(frozen=True)
class FrameTransform:
    """Transformation to the fixed frame at one time: y = T x, T' = W T, T W = W T.

    `rotation` is T (n, n), `rates` is W (n, n), 1/s.
    """

    rotation: Array
    rates: Array

    def advance(self, dt: float) -> FrameTransform:
        """Transformation dt (s) later."""
        return FrameTransform(self.rotation @ expm(self.rates * dt), self.rates)

    def matrices(self, found: Matrices) -> Matrices:
        """Matrices M, C, K of y from those of x."""
        back, w = np.linalg.inv(self.rotation), self.rates
        m, c, k = (back.T @ one @ back for one in (found.M, found.C, found.K))
        return Matrices(m, c - 2 * m @ w, k - c @ w + m @ w @ w)

    def input_matrix(self, columns: Array) -> Array:
        """Input columns (n, inputs) of y from those of x."""
        return np.asarray(np.linalg.solve(self.rotation.T, columns))

    def rows(self, orders: dict[int, Array], places: list[int]) -> dict[int, Array]:
        """Output rows of y (outputs, nu), by power of s, from those of x at indices `places`."""
        back, found = np.linalg.inv(self.rotation), {k: wide.copy() for k, wide in orders.items()}
        for order in sorted(orders, reverse=True):
            own = orders[order][:, places] @ back
            found[order][:, places] += own - orders[order][:, places]
            for lower, factor in _BELOW[order]:
                rows = found.setdefault(lower, np.zeros_like(orders[order]))
                rows[:, places] += factor * own @ np.linalg.matrix_power(self.rates, order - lower)
        return found


#: Lower-order terms of x^(order) = T^-1 (y^(order) + ...): (order of y, factor of a power of W).
_BELOW = {0: (), 1: ((0, -1.0),), 2: ((1, -2.0), (0, 1.0))}
