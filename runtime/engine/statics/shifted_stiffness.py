"""Stiffness of a scene at rest beside its inertia, K + sigma W: products, solutions, O(bodies).

Solutions are along motions that closed loops allow.  A tree is eliminated without its loops and
springs, and may stand on pivots that are next to nothing where these alone hold it: each solution
is refined by what it leaves, and refused where that goes on changing it.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..tangent import Tangent

#: What a refinement may change of a solution that is refined no more, in parts, and how many there
#: are at most.
_SMALL, _REFINEMENTS = 1e-4, 3


class Unsolved(NumericalFailure):
    """Solutions are rounding with so small a sigma."""


class ShiftedStiffness:
    """Of the scene of a tangent at time t; `sizes` (nu,) are motions of order one."""

    def __init__(self, tangent: Tangent, t: float, sizes: Array) -> None:
        self.tangent, self.t, self.sizes, self.sigma = tangent, t, sizes, 0.0
        self.still, self.placed = np.zeros(tangent.nu), np.zeros(tangent.nq)
        tangent.allow_negative()
        tangent.record.rows_of_motion = 1
        system, first = tangent.engine.packed.system, tangent.engine.packed.system.places["u"]
        own = [first[one.frame] + np.arange(system.body(one.frame).nu) for one in system.closures]
        #: Speeds of hinges that close loops, which follow the others.
        self.own = np.concatenate([np.zeros(0, np.int64), *own])

    def residual(self, q: Array) -> Array:
        """Efforts R (nu,) that rest lacks at q, where all else is meant from now on."""
        return self.tangent.residual(self.t, q, self.still, self.still)

    def factor(self, sigma: float) -> None:
        """Factor K + sigma W.  NumericalFailure where it is singular."""
        self.sigma = sigma
        self.tangent.factor(sigma, 1.0, 0.0, rate=0.0)

    def solve(self, efforts: Array) -> Array:
        """x (nu,), allowed by loops, with (K + sigma W) x = efforts along all that they allow.

        Raises Unsolved where that is rounding.
        """
        x = self.tangent.solve(efforts)
        for _ in range(_REFINEMENTS):
            left = efforts - self._along(self.tangent.coordinates(x), self.sigma * x)
            change = self.tangent.solve(left)
            x = x + change
            changed, whole = self.length(change), self.length(x)
            if changed <= _SMALL * whole:
                return x
        raise Unsolved("the stiffness is rounding here")

    def press(self, x: Array) -> Array:
        """K x (nu,)."""
        return self._along(self.tangent.coordinates(x), self.still)

    def inertia(self, x: Array) -> Array:
        """W x (nu,)."""
        return self._along(self.placed, x)

    def length(self, x: Array) -> float:
        """The largest motion in sizes."""
        return float(np.abs(x / self.sizes).max(initial=0.0))

    def _along(self, moved: Array, rates: Array) -> Array:
        efforts = self.tangent.slope(0.0, moved, self.still, rates)
        efforts[self.own] = 0.0
        return efforts
