"""The way to rest of trees with many bodies: pseudo-time by the factored tangent, O(bodies) a step.

    (K + sigma M) x = -R(q)

is a step of the motion without speed, downhill in whatever has a potential; sigma is an inverse
time squared.  It falls while steps go downhill, so that the way ends in Newton's method
(pseudo-transient continuation; Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508-523).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from .rest import Unsettled
from .tangent import Tangent


class Loose(NumericalFailure):
    """Rest that nothing holds along some speeds, whose places are `speeds`."""

    def __init__(self, speeds: tuple[int, ...]) -> None:
        super().__init__("nothing holds this rest")
        self.speeds = speeds


_MOST, _NEWTON = 2000, 40
#: Steps in sizes of the coordinates: the longest, and that of the first one.
_LONGEST, _FIRST = 0.5, 0.05
#: By how much sigma falls behind a step that goes downhill and rises before one that would go
#: beyond the bottom; how long a step, in sizes, still lets Newton's method be tried without it.
_EASED, _HELD, _NEAR = 2.0, 4.0, 1e-2
#: A step that is rounding, in sizes.
_AT_REST = 1e-12
#: Efforts that a solution leaves, in parts, where the stiffness it is of is rounding.
_NOISE = 1e-6
#: Cycles of rounding: a step that no longer shrinks below this, in sizes, is as near as numbers go.
_ROUNDING = 1e-7


class RestBySweep:
    """Rest of a packed scene at time t.

    `sizes` (nu,) are motions of order one, `free` the places of speeds that nobody imposes,
    `acceleration` gives the accelerations (nu,) at rest,
    `settled` puts a state's drives and quaternions in order.
    """

    def __init__(
        self,
        tangent: Tangent,
        t: float,
        sizes: Array,
        free: Sequence[int],
        acceleration: Callable[[Array], Array],
        settled: Callable[[Array], Array],
    ) -> None:
        self.tangent, self.t, self.sizes, self.free = tangent, t, sizes, free
        self.acceleration, self.settled = acceleration, settled
        self._still = np.zeros(tangent.nu)

    def find(self, q: Array, tolerance: float) -> Array:
        """q (nq,) at rest, coordinates within `tolerance` times their sizes.  Raises Unsettled,
        Loose, and NumericalFailure naming a motion that nothing holds."""
        q, near = self.settled(q), _NEAR
        missing = self._residual(q)
        sigma = self._unrest(q) / _FIRST
        for _ in range(_MOST):
            step = self._downhill(missing, sigma)
            if step is not None and self._length(step) <= near:
                try:
                    return self._newton(q, tolerance)
                except NumericalFailure:
                    if near < _AT_REST:  # nothing holds it here, nor drives it away
                        raise
                    near /= 10  # too far away still, or beside a rest that does not last
                missing = self._residual(q)
                continue
            ahead = q if step is None else self._after(q, step)
            left = missing if step is None else self._residual(ahead)
            # Beyond the bottom by much, or no way down with so little inertia
            if step is None or float(left @ step) > -0.5 * float(missing @ step):
                sigma *= _HELD
                missing = self._residual(q)
            else:
                q, missing, sigma = ahead, left, sigma / _EASED
        raise Unsettled(f"no rest after {_MOST} steps", missing)

    def _downhill(self, missing: Array, sigma: float) -> Array | None:
        """The step, None where the stiffness with so much inertia is not positive."""
        try:
            return self._step(missing, sigma)
        except NumericalFailure:
            return None if sigma > 0 else 0.0 * missing

    def _newton(self, q: Array, tolerance: float) -> Array:
        shortest = np.inf
        for _ in range(_NEWTON):
            step = self._step(self._residual(q), 0.0)
            length = self._length(step)
            q = self._after(q, step)
            if length <= tolerance or (length >= shortest and length < _ROUNDING):
                self._refuse_loose(q)
                return q
            if length > 2 * shortest or length >= _LONGEST:
                break
            shortest = min(shortest, length)
        raise Unsettled(f"no rest after {_NEWTON} steps of Newton's method", self._residual(q))

    def _refuse_loose(self, q: Array) -> None:
        """What a stiffness of rounding solves, it does not solve."""
        self._residual(q)
        self.tangent.factor(0.0, 1.0, 0.0, rate=0.0)
        pushed, free = self._still.copy(), list(self.free)
        pushed[free] = np.random.default_rng(0).standard_normal(len(free)) / self.sizes[free]
        x = self.tangent.solve(pushed)
        moved = self.tangent.coordinates(x)
        left = self.tangent.slope(0.0, moved, self._still, self._still) - pushed
        whole, missing = (float(np.linalg.norm(one * self.sizes)) for one in (pushed, left))
        if not missing <= _NOISE * whole:
            far = np.abs(x / self.sizes)
            raise Loose(tuple(np.flatnonzero(far > 0.1 * far.max()).tolist()))

    def _residual(self, q: Array) -> Array:
        return self.tangent.residual(self.t, q, self._still, self._still)

    def _unrest(self, q: Array) -> float:
        """The largest acceleration, in sizes."""
        found = float(np.abs(self.acceleration(q) / self.sizes).max(initial=0.0))
        if not np.isfinite(found):
            raise NumericalFailure("the accelerations of this state are not finite")
        return found

    def _step(self, missing: Array, sigma: float) -> Array:
        """From the state whose residual has just been made."""
        self.tangent.factor(sigma, 1.0, 0.0, rate=0.0)
        step = -self.tangent.solve(missing)
        return step / max(1.0, self._length(step) / _LONGEST)

    def _length(self, step: Array) -> float:
        return float(np.abs(step / self.sizes).max(initial=0.0))

    def _after(self, q: Array, step: Array) -> Array:
        """The tangent must be that of q: it turns a motion into a change of coordinates."""
        return self.settled(q + self.tangent.coordinates(step))
