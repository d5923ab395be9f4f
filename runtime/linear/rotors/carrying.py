"""Transformation of linear equations from rotating to fixed frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from mstmm.array_validation import Array

from ..mck_matrices import Matrices


@dataclass(frozen=True)
class Carrying:
    """Transformation to the fixed frame at one time: y = T x, T' = W T, T W = W T.

    `turned` is T (n, n), `rates` is W (n, n), 1/s.
    """

    turned: Array
    rates: Array

    def later(self, dt: float) -> Carrying:
        """Transformation dt (s) later."""
        return Carrying(self.turned @ expm(self.rates * dt), self.rates)

    def matrices(self, found: Matrices) -> Matrices:
        """Matrices M, C, K of y from those of x."""
        back, w = np.linalg.inv(self.turned), self.rates
        m, c, k = (back.T @ one @ back for one in (found.M, found.C, found.K))
        return Matrices(m, c - 2 * m @ w, k - c @ w + m @ w @ w)

    def pushed(self, columns: Array) -> Array:
        """Input columns (n, inputs) of y from those of x."""
        return np.asarray(np.linalg.solve(self.turned.T, columns))

    def rows(self, orders: dict[int, Array], places: list[int]) -> dict[int, Array]:
        """Output rows of y (outputs, nu), by power of s, from those of x at indices `places`."""
        back, found = np.linalg.inv(self.turned), {k: wide.copy() for k, wide in orders.items()}
        for order in sorted(orders, reverse=True):
            own = orders[order][:, places] @ back
            found[order][:, places] += own - orders[order][:, places]
            for lower, factor in _BELOW[order]:
                rows = found.setdefault(lower, np.zeros_like(orders[order]))
                rows[:, places] += factor * own @ np.linalg.matrix_power(self.rates, order - lower)
        return found


#: Lower-order terms of x^(order) = T^-1 (y^(order) + ...): (order of y, factor of a power of W).
_BELOW = {0: (), 1: ((0, -1.0),), 2: ((1, -2.0), (0, 1.0))}
