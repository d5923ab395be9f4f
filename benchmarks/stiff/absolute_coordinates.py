"""Rods on bushings in absolute coordinates, for SciPy's Radau with an exact sparse Jacobian.

The same motion as `scenes.bushed_rods`, written without a multibody program:
mass centres and absolute angles, a constant mass matrix, forces between neighbours alone.  The
Jacobian is banded then; its blocks come from complex steps along all columns that share no row,
exact to rounding.  It uses no code of mstmm and is an independent reference too.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.integrate
import scipy.sparse

Array = np.ndarray
HALF, MASS, INERTIA, GRAVITY = 0.5, 1.0, 1 / 12, 9.81  # m, kg, kg m2, m/s2
_STEP = 1e-30


def _quarter_turn(v: Array) -> Array:
    """(..., 2) by a quarter to the left."""
    return np.stack([-v[..., 1], v[..., 0]], axis=-1)


class BushedRods:
    """State: x, y, angle of every mass centre in turn (3 n), then their rates."""

    def __init__(self, count: int, k: float, zeta: float) -> None:
        self.n, self.k, self.c = count, k, 2 * zeta * np.sqrt(k * MASS)
        self.evaluations = self.jacobians = 0
        initial = np.zeros((count, 3))
        initial[:, 0] = HALF + np.arange(count)
        self.initial_state = np.concatenate([initial.ravel(), np.zeros(3 * count)])
        self._directions, self._rows, self._columns, self._source = self._colours()

    def end_kinematics(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Places and velocities (..., n, 2) of inboard ends, then of tips."""
        x, v = np.split(y.reshape(*y.shape[:-1], 2, self.n, 3), 2, axis=-3)
        x, v = x[..., 0, :, :], v[..., 0, :, :]
        arm = HALF * np.stack([np.cos(x[..., 2]), np.sin(x[..., 2])], axis=-1)
        relative_velocity = v[..., 2, None] * _quarter_turn(arm)
        return (
            x[..., :2] - arm,
            v[..., :2] - relative_velocity,
            x[..., :2] + arm,
            v[..., :2] + relative_velocity,
        )

    def rates(self, t: float, y: Array) -> Array:
        """dy/dt (..., 6 n)."""
        self.evaluations += 1
        nq = 3 * self.n
        inboard, inboard_rate, tip, tip_rate = self.end_kinematics(y)
        x = y[..., :nq].reshape(*y.shape[:-1], self.n, 3)
        spin = y[..., nq + 2 :: 3]
        separation, rate = inboard.copy(), inboard_rate.copy()
        separation[..., 1:, :] -= tip[..., :-1, :]
        rate[..., 1:, :] -= tip_rate[..., :-1, :]
        # The damper sees the stretch in axes that turn with the inboard rod.
        rate[..., 1:, :] -= spin[..., :-1, None] * _quarter_turn(separation[..., 1:, :])
        force = -self.k * separation - self.c * rate
        a = np.zeros_like(x)
        a[..., :2] = force / MASS
        a[..., 2] = _cross(inboard - x[..., :2], force) / INERTIA
        a[..., :-1, :2] -= force[..., 1:, :] / MASS
        a[..., :-1, 2] -= _cross(inboard[..., 1:, :] - x[..., :-1, :2], force[..., 1:, :]) / INERTIA
        a[..., 1] -= GRAVITY
        return np.concatenate([y[..., nq:], a.reshape(*y.shape[:-1], nq)], axis=-1)

    def jacobian(self, t: float, y: Array) -> scipy.sparse.csc_matrix:
        """d(dy/dt)/dy from 18 directions at once."""
        self.jacobians += 1
        derivatives = self.rates(t, y + 1j * _STEP * self._directions).imag / _STEP
        self.evaluations -= 1
        entries = derivatives[self._source, self._rows]
        size = 6 * self.n
        return scipy.sparse.csc_matrix((entries, (self._rows, self._columns)), (size, size))

    def _colours(self) -> tuple[Array, Array, Array, Array]:
        """Directions (18, 6 n): rods 3 apart share no row; and where each entry is found."""
        size, nq = 6 * self.n, 3 * self.n
        directions = np.zeros((18, size))
        rows, columns, source = [], [], []
        for rod in range(self.n):
            neighbours = [r for r in (rod - 1, rod, rod + 1) if 0 <= r < self.n]
            dependent_rows = [nq + 3 * r + i for r in neighbours for i in range(3)]
            for i in range(6):
                column = (nq if i > 2 else 0) + 3 * rod + i % 3
                direction = 6 * (rod % 3) + i
                directions[direction, column] = 1.0
                entry_rows = [*dependent_rows, column - nq] if i > 2 else dependent_rows
                rows += entry_rows
                columns += [column] * len(entry_rows)
                source += [direction] * len(entry_rows)
        return directions, np.array(rows), np.array(columns), np.array(source)

    def tips(self, y: Array) -> Array:
        """(n, 3) m."""
        return np.column_stack([self.end_kinematics(y)[2], np.zeros(self.n)])

    def run(
        self, t_end: float, rtol: float, speed_factor: float
    ) -> tuple[Callable[[], Array], dict[str, int]]:
        """Function that returns the tips at t_end, and counts; the absolute tolerance of speeds is
        multiplied by `speed_factor`."""
        self.evaluations = self.jacobians = 0
        weights = np.repeat([1.0, speed_factor], 3 * self.n)
        solution = scipy.integrate.solve_ivp(
            self.rates, (0.0, t_end), self.initial_state, method="Radau", jac=self.jacobian,
            rtol=rtol, atol=1e-2 * rtol * weights, t_eval=[t_end],
        )  # fmt: skip
        if not solution.success:
            raise RuntimeError(solution.message)
        counts = {"rates": self.evaluations, "jacobians": self.jacobians, "factors": solution.nlu}
        return lambda: self.tips(solution.y[:, -1]), counts


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
