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

    def matrices(self, given: Matrices) -> Matrices:
        """Matrices M, C, K of y from those of x."""
        back, w = np.linalg.inv(self.rotation), self.rates
        m, c, k = (back.T @ matrix @ back for matrix in (given.M, given.C, given.K))
        return Matrices(m, c - 2 * m @ w, k - c @ w + m @ w @ w)

    def input_matrix(self, columns: Array) -> Array:
        """Input columns (n, inputs) of y from those of x."""
        return np.asarray(np.linalg.solve(self.rotation.T, columns))

    def rows(self, orders: dict[int, Array], column_indices: list[int]) -> dict[int, Array]:
        """Output rows of y (outputs, nu), by power of s, from those of x at `column_indices`."""
        back, rotated = np.linalg.inv(self.rotation), {k: wide.copy() for k, wide in orders.items()}
        for order in sorted(orders, reverse=True):
            own = orders[order][:, column_indices] @ back
            rotated[order][:, column_indices] += own - orders[order][:, column_indices]
            for lower, factor in _BELOW[order]:
                rows = rotated.setdefault(lower, np.zeros_like(orders[order]))
                rows[:, column_indices] += (
                    factor * own @ np.linalg.matrix_power(self.rates, order - lower)
                )
        return rotated


#: Lower-order terms of x^(order) = T^-1 (y^(order) + ...): (order of y, factor of a power of W).
_BELOW = {0: (), 1: ((0, -1.0),), 2: ((1, -2.0), (0, 1.0))}
