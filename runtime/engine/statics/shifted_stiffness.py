"""Shifted stiffness K + sigma W of a scene at rest: products and solutions in O(bodies).

W is the inertia.  Solutions are motions that closed loops permit.  The tree is eliminated without
its loops and springs, with very small pivots if only these support it.  Each solution is therefore
refined by its residual, and rejected if refinement does not converge.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..tangent_matrix import TangentMatrix

#: Relative change of a solution at which refinement ends, and maximum number of refinements.
_CONVERGED_CHANGE, _MAX_REFINEMENTS = 1e-4, 3


class SolutionIsRounding(NumericalFailure):
    """Failure: sigma is so small that solutions are rounding errors."""


class ShiftedStiffness:
    """Shifted stiffness of the scene of a tangent at time t (s).

    `sizes` (nu,) are the characteristic scales of the speeds.
    """

    def __init__(self, tangent: TangentMatrix, t: float, sizes: Array) -> None:
        self.tangent, self.t, self.sizes, self.sigma = tangent, t, sizes, 0.0
        self.zero_speeds, self.placed = np.zeros(tangent.nu), np.zeros(tangent.nq)
        tangent.allow_negative()
        tangent.record.rows_of_motion = 1
        system, first_speeds = (
            tangent.engine.packed.system,
            tangent.engine.packed.system.first_indices["u"],
        )
        closing_speeds = [
            first_speeds[closure.frame] + np.arange(system.body(closure.frame).nu)
            for closure in system.closures
        ]
        #: Indices of the dependent speeds of hinges that close loops.
        self.closing_speeds = np.concatenate([np.zeros(0, np.int64), *closing_speeds])

    def residual(self, q: Array) -> Array:
        """Compute the unbalanced efforts R (nu,) at q, to which subsequent calls refer."""
        return self.tangent.residual(self.t, q, self.zero_speeds, self.zero_speeds)

    def factor(self, sigma: float) -> None:
        """Factor K + sigma W; raises NumericalFailure if it is singular."""
        self.sigma = sigma
        self.tangent.factor(sigma, 1.0, 0.0, rate=0.0)

    def solve(self, efforts: Array) -> Array:
        """Solve (K + sigma W) x = efforts (nu,) for motions x (nu,) that loops permit.

        Raises SolutionIsRounding if refinement does not converge.
        """
        x = self.tangent.solve(efforts)
        for _ in range(_MAX_REFINEMENTS):
            residual_efforts = efforts - self._directional_efforts(
                self.tangent.coordinates(x), self.sigma * x
            )
            change = self.tangent.solve(residual_efforts)
            x = x + change
            change_size, solution_size = self.length(change), self.length(x)
            if change_size <= _CONVERGED_CHANGE * solution_size:
                return x
        raise SolutionIsRounding("the stiffness is lost to rounding")

    def press(self, x: Array) -> Array:
        """Product K x (nu,)."""
        return self._directional_efforts(self.tangent.coordinates(x), self.zero_speeds)

    def inertia(self, x: Array) -> Array:
        """Product W x (nu,)."""
        return self._directional_efforts(self.placed, x)

    def length(self, x: Array) -> float:
        """Largest component of a motion in characteristic scales."""
        return float(np.abs(x / self.sizes).max(initial=0.0))

    def _directional_efforts(self, moved: Array, rates: Array) -> Array:
        efforts = self.tangent.slope(0.0, moved, self.zero_speeds, rates)
        efforts[self.closing_speeds] = 0.0
        return efforts
