"""Rods on bushings in absolute coordinates, for SciPy's Radau with an exact sparse Jacobian.

The same motion as `scenes.bushed_rods`, as somebody would write it who has no multibody program:
mass centres and absolute angles, a constant mass matrix, forces between neighbours alone.  The
Jacobian is banded then; its blocks come from complex steps along all columns that share no row,
exact to rounding.  Nothing here is of mstmm, so that it is an independent reference too.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.integrate
import scipy.sparse

Array = np.ndarray
HALF, MASS, INERTIA, GRAVITY = 0.5, 1.0, 1 / 12, 9.81  # m, kg, kg m2, m/s2
_STEP = 1e-30


def _turned(v: Array) -> Array:
    """(..., 2) by a quarter to the left."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


class BushedRods:
    """State: x, y, angle of every mass centre in turn (3 n), then their rates."""

    def __init__(self, count: int, k: float, zeta: float) -> None:
        self.n, self.k, self.c = count, k, 2 * zeta * np.sqrt(k * MASS)
        self.evaluations = self.jacobians = 0
        rest = np.zeros((count, 3))
        rest[:, 0] = HALF + np.arange(count)
        self.start = np.concatenate([rest.ravel(), np.zeros(3 * count)])
        self._directions, self._rows, self._columns, self._source = self._colours()

    def ends(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Places and velocities (..., n, 2) of inboard ends, then of tips."""
        x, v = np.split(y.reshape(*y.shape[:-1], 2, self.n, 3), 2, axis=-3)
        x, v = x[..., 0, :, :], v[..., 0, :, :]
        arm = HALF * np.stack([np.cos(x[..., 2]), np.sin(x[..., 2])], axis=-1)
        swing = v[..., 2, None] * _turned(arm)
        return x[..., :2] - arm, v[..., :2] - swing, x[..., :2] + arm, v[..., :2] + swing

    def rates(self, t: float, y: Array) -> Array:
        """dy/dt (..., 6 n)."""
        self.evaluations += 1
        half = 3 * self.n
        inner, inner_rate, tip, tip_rate = self.ends(y)
        x = y[..., :half].reshape(*y.shape[:-1], self.n, 3)
        spin = y[..., half + 2 :: 3]
        gap, rate = inner.copy(), inner_rate.copy()
        gap[..., 1:, :] -= tip[..., :-1, :]
        rate[..., 1:, :] -= tip_rate[..., :-1, :]
        # The damper sees the stretch in axes that turn with the inboard rod.
        rate[..., 1:, :] -= spin[..., :-1, None] * _turned(gap[..., 1:, :])
        force = -self.k * gap - self.c * rate
        a = np.zeros_like(x)
        a[..., :2] = force / MASS
        a[..., 2] = _cross(inner - x[..., :2], force) / INERTIA
        a[..., :-1, :2] -= force[..., 1:, :] / MASS
        a[..., :-1, 2] -= _cross(inner[..., 1:, :] - x[..., :-1, :2], force[..., 1:, :]) / INERTIA
        a[..., 1] -= GRAVITY
        return np.concatenate([y[..., half:], a.reshape(*y.shape[:-1], half)], axis=-1)

    def jacobian(self, t: float, y: Array) -> scipy.sparse.csc_matrix:
        """d(dy/dt)/dy from 18 directions at once."""
        self.jacobians += 1
        found = self.rates(t, y + 1j * _STEP * self._directions).imag / _STEP
        self.evaluations -= 1
        entries = found[self._source, self._rows]
        size = 6 * self.n
        return scipy.sparse.csc_matrix((entries, (self._rows, self._columns)), (size, size))

    def _colours(self) -> tuple[Array, Array, Array, Array]:
        """Directions (18, 6 n): rods 3 apart share no row; and where each entry is found."""
        size, half = 6 * self.n, 3 * self.n
        directions = np.zeros((18, size))
        rows, columns, source = [], [], []
        for rod in range(self.n):
            near = [r for r in (rod - 1, rod, rod + 1) if 0 <= r < self.n]
            touched = [half + 3 * r + i for r in near for i in range(3)]
            for i in range(6):
                column = (half if i > 2 else 0) + 3 * rod + i % 3
                direction = 6 * (rod % 3) + i
                directions[direction, column] = 1.0
                own = [*touched, column - half] if i > 2 else touched
                rows += own
                columns += [column] * len(own)
                source += [direction] * len(own)
        return directions, np.array(rows), np.array(columns), np.array(source)

    def tips(self, y: Array) -> Array:
        """(n, 3) m."""
        return np.column_stack([self.ends(y)[2], np.zeros(self.n)])

    def run(
        self, t_end: float, rtol: float, slack: float
    ) -> tuple[Callable[[], Array], dict[str, int]]:
        """How to get the tips at t_end, and what it took; speeds get `slack` times the absolute
        tolerance."""
        self.evaluations = self.jacobians = 0
        weights = np.repeat([1.0, slack], 3 * self.n)
        found = scipy.integrate.solve_ivp(
            self.rates, (0.0, t_end), self.start, method="Radau", jac=self.jacobian,
            rtol=rtol, atol=1e-2 * rtol * weights, t_eval=[t_end],
        )  # fmt: skip
        if not found.success:
            raise RuntimeError(found.message)
        counts = {"rates": self.evaluations, "jacobians": self.jacobians, "factors": found.nlu}
        return lambda: self.tips(found.y[:, -1]), counts


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
