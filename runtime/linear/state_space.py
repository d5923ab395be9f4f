"""Linear equations of motion as a first-order state-space system."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array

from .input_channels import Channel
from .linear_equations import LinearEquations
from .outputs.linear_outputs import Rows


class StateSpace(LinearEquations):
    """First-order system d/dt z = A z + B v + B_disturbances w; see `LinearEquations`.

    z = (x, x'), followed by d, d' of drives whose accelerations are inputs.
    """

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states (x, x') or (x, x', d, d')."""
        parts = self.coordinates, self.driven
        return tuple(f"{name}{rate}" for names in parts for rate in ("", "'") for name in names)

    @property
    def positions(self) -> list[int]:
        """Indices of x and d in the state."""
        n, k = len(self), len(self.drives)
        return [*range(n), *range(2 * n, 2 * n + k)]

    @property
    def velocities(self) -> list[int]:
        """Indices of x' and d' in the state."""
        n, k = len(self), len(self.drives)
        return [*range(n, 2 * n), *range(2 * n + k, 2 * n + 2 * k)]

    @cached_property
    def A(self) -> Array:
        """System matrix (2 n + 2 k, 2 n + 2 k) with k drives."""
        if not self.drives:
            return self._undriven
        found = np.zeros((len(self.states), len(self.states)))
        found[self.positions, self.velocities] = 1.0
        n = len(self)
        found[: 2 * n, : 2 * n] = self._undriven
        both = np.hstack([self.K_driven, self.C_driven])
        found[n : 2 * n, 2 * n :] = -np.linalg.solve(self.M, both)
        return found

    @property
    def _undriven(self) -> Array:
        """System matrix (2 n, 2 n) of (x, x') without motion of drives."""
        if self.about is not None and self.carrying is None:
            found = self.model.slopes.state_matrix(self.about, self.turning is not None)
            if found is not None:
                return found
        n = len(self)
        below = -np.linalg.solve(self.M, np.hstack([self.K, self.C]))
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), below])

    @cached_property
    def B(self) -> Array:
        """Input matrix (2 n + 2 k, inputs)."""
        return self._pushing(self.controls, self.V)

    @cached_property
    def B_disturbances(self) -> Array:
        """Input matrix (2 n + 2 k, disturbances) of w."""
        return self._pushing(self.others, self.W)

    def observed(self, rows: Rows, b: Array) -> tuple[Array, Array]:
        """C (outputs, states) and D (outputs, pushes) of output rows.

        `b` (states, pushes) is the input matrix of d/dt z.
        """
        speeds, rates = [*self.free, *self.drives], self.velocities
        c, d = np.zeros((len(rows.through), len(self.states))), rows.through
        for order, wide in rows.orders.items():
            some = wide[:, speeds]
            if order < 2:
                c[:, (self.positions, rates)[order]] += some
            else:  # accelerations
                c, d = c + some @ self.A[rates], d + some @ b[rates]
        return c, d

    def _pushing(self, pushes: Sequence[Channel], efforts: Array) -> Array:
        found = np.zeros((len(self.states), len(pushes)))
        n, k = len(self), len(self.drives)
        found[n : 2 * n] = np.linalg.solve(self.M, efforts)
        for j, one in enumerate(pushes):
            for speed, factor in one.moves:
                found[2 * n + k + self.drives.index(speed), j] = factor
        return found
