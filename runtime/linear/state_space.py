"""Linear equations of motion as a first-order system."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mstmm.arrays import Array

from .equations import Equations


class StateSpace(Equations):
    """d/dt (x, x') = A (x, x') + B v + B_disturbances w; see `Equations`."""

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the state (x, x')."""
        return (*self.coordinates, *(f"{name}'" for name in self.coordinates))

    @cached_property
    def A(self) -> Array:
        """(2 n, 2 n): d/dt (x, x') = A (x, x') + B v."""
        if self.about is not None:
            found = self.model.slopes.state_matrix(self.about, self.turning is not None)
            if found is not None:
                return found
        n = len(self)
        below = -np.linalg.solve(self.M, np.hstack([self.K, self.C]))
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), below])

    @cached_property
    def B(self) -> Array:
        """(2 n, inputs)."""
        return np.vstack([np.zeros_like(self.V), np.linalg.solve(self.M, self.V)])

    @cached_property
    def B_disturbances(self) -> Array:
        """(2 n, disturbances): what w adds."""
        return np.vstack([np.zeros_like(self.W), np.linalg.solve(self.M, self.W)])
