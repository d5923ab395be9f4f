"""Linear equations of motion as a first-order state-space system."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array

from .input_channels import Channel
from .linear_equations import LinearEquations
from .outputs import Rows


class StateSpace(LinearEquations):
    """First-order system d/dt z = A z + B v + B_disturbances w; see `LinearEquations`.

    z = (x, x'), followed by d, d' of drives whose accelerations are inputs.
    """

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states (x, x') or (x, x', d, d')."""
        parts = self.coordinate_names, self.prescribed_coordinates
        return tuple(f"{name}{rate}" for names in parts for rate in ("", "'") for name in names)

    @property
    def position_states(self) -> list[int]:
        """Indices of x and d in the state."""
        n, k = len(self), len(self.drive_indices)
        return [*range(n), *range(2 * n, 2 * n + k)]

    @property
    def velocity_states(self) -> list[int]:
        """Indices of x' and d' in the state."""
        n, k = len(self), len(self.drive_indices)
        return [*range(n, 2 * n), *range(2 * n + k, 2 * n + 2 * k)]

    @cached_property
    def A(self) -> Array:
        """System matrix (2 n + 2 k, 2 n + 2 k) with k drives."""
        if not self.drive_indices:
            return self._undriven
        matrix = np.zeros((len(self.state_names), len(self.state_names)))
        matrix[self.position_states, self.velocity_states] = 1.0
        n = len(self)
        matrix[: 2 * n, : 2 * n] = self._undriven
        both = np.hstack([self.K_prescribed, self.C_prescribed])
        matrix[n : 2 * n, 2 * n :] = -np.linalg.solve(self.M, both)
        return matrix

    @property
    def _undriven(self) -> Array:
        """System matrix (2 n, 2 n) of (x, x') without motion of drives."""
        if self.compiled_state is not None and self.frame_transform is None:
            matrix = self.model.compiled_linearisation.state_matrix(
                self.compiled_state, self.rate_matrix is not None
            )
            if matrix is not None:
                return matrix
        n = len(self)
        below = -np.linalg.solve(self.M, np.hstack([self.K, self.C]))
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), below])

    @cached_property
    def B(self) -> Array:
        """Input matrix (2 n + 2 k, inputs)."""
        return self._input_columns(self.input_channels, self.V)

    @cached_property
    def B_disturbances(self) -> Array:
        """Input matrix (2 n + 2 k, disturbances) of w."""
        return self._input_columns(self.disturbance_channels, self.W)

    def state_output_matrices(self, rows: Rows, b: Array) -> tuple[Array, Array]:
        """C (outputs, states) and D (outputs, pushes) of output rows.

        `b` (states, pushes) is the input matrix of d/dt z.
        """
        speeds, rates = [*self.free_speed_indices, *self.drive_indices], self.velocity_states
        c, d = np.zeros((len(rows.feedthrough), len(self.state_names))), rows.feedthrough
        for order, wide in rows.orders.items():
            some = wide[:, speeds]
            if order < 2:
                c[:, (self.position_states, rates)[order]] += some
            else:  # accelerations
                c, d = c + some @ self.A[rates], d + some @ b[rates]
        return c, d

    def _input_columns(self, pushes: Sequence[Channel], efforts: Array) -> Array:
        input_matrix = np.zeros((len(self.state_names), len(pushes)))
        n, k = len(self), len(self.drive_indices)
        input_matrix[n : 2 * n] = np.linalg.solve(self.M, efforts)
        for j, channel in enumerate(pushes):
            for speed, factor in channel.drive_factors:
                input_matrix[2 * n + k + self.drive_indices.index(speed), j] = factor
        return input_matrix
