"""Linear: a scene made linear about a state, and what follows from that."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError

from ..pack.layout import refuse_dense
from .equations import Equations
from .judged import warnings_of
from .modes import Modes, modes


class Linear(Equations):
    """Linear equations of motion with their state space and natural motions; see `Equations`."""

    def modes(self, count: int | None = None, damped: bool | None = None) -> Modes:
        """Natural motions: all, or the `count` slowest ones; with C where there is any, `damped`
        False leaves it out.

        Few of many come by shift and invert over the O(bodies) solution.  Of undamped ones the
        pivots of the sweep count how many there are, so that none is missed.

        Raises SceneError for a count that makes no sense, NumericalFailure where a motion moves no
        inertia or the iteration does not converge.
        """
        if count is not None and (isinstance(count, bool) or not 0 < count <= len(self)):
            raise SceneError(
                f"count = {count!r}: expected a number of motions from 1 to {len(self)}"
            )
        if count is None:
            refuse_dense(len(self), "the matrix of all motions")
        return modes(self, count, damped)

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What speaks against taking the model for the scene, in sentences."""
        return tuple(warnings_of(self, self.modes()))

    # --- state space ------------------------------------------------------------------------------

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the state (x, x')."""
        return (*self.coordinates, *(f"{name}'" for name in self.coordinates))

    @cached_property
    def A(self) -> Array:
        """(2 n, 2 n): d/dt (x, x') = A (x, x') + B v."""
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
