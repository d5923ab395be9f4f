"""The way to static equilibrium by the factored tangent, O(bodies) a step.

    (K + sigma W) x = -R(q),   J x = 0

is a step downhill of whatever has a potential: R are the efforts that rest lacks, K their slopes, J
the rows of closed loops, and W the inertia with rotors on the hinges.  Equilibrium does not depend
on W, but the way there does: beside the inertia of bodies alone, chains of many links crumple
where their loads push for a while.  sigma, an inverse time squared, falls while steps go downhill,
so that the way ends in Newton's method (pseudo-transient continuation; Kelley and Keyes, SIAM J.
Numer. Anal. 35 (1998) 508-523).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from .rest import Unsettled
from .shifted_stiffness import ShiftedStiffness, Unsolved

#: Steps at most, where nobody asks for another number.
MOST = 2000
#: Steps in sizes of the coordinates: the longest, and that of the first one.
_LONGEST, _FIRST = 0.5, 0.05
#: By how much sigma falls behind a step that goes downhill, and rises before one that would not.
_EASED, _HELD = 4.0, 4.0
#: From so many times its first value on no step leads anywhere.
_STUCK = 1e8
#: Steps, in sizes, below which efforts may be rounding; by how much sigma falls between steps that
#: are short enough, and parts of its first value below which nothing is left of it.
_ROUNDING, _DROPPED, _GONE = 1e-6, 64.0, 1e-20
#: Changes of q, in parts, by which rounding is seen, how often, and how many times it may be more.
_NUDGE, _NUDGES, _MORE = 4e-16, 3, 10.0
#: Rounding of efforts, in parts of those that cancel.
_CANCELLED = 2e-16


class RestBySweep:
    """The search from one state.

    `settled` puts a state's drives, quaternions and loops in order or raises NumericalFailure,
    `load` is the work, J, of all forces that may cancel over motions of order one, `progress` is
    called with the number of every step and its length in sizes.
    """

    def __init__(
        self,
        stiffness: ShiftedStiffness,
        settled: Callable[[Array], Array],
        load: float,
        most: int = MOST,
        progress: Callable[[int, float], None] | None = None,
    ) -> None:
        self.stiffness, self.settled, self.most, self.progress = stiffness, settled, most, progress
        self.cancelled = _CANCELLED * load  #: J, where sigma falls no more
        self.steps = 0  #: taken by the last search
        self._least = 0.0  # sigma, with which solutions are no rounding

    def find(self, q: Array, tolerance: float) -> Array:
        """q (nq,) at rest, coordinates within `tolerance` times their sizes, or within rounding.

        Raises Unsettled with what is missing (nu,) after `most` steps.
        """
        self.steps, q = 0, self.settled(q)
        missing, near = self.stiffness.residual(q), False
        if self._is_rounding(q, missing):
            return q
        sigma = first = self._unrest(q) / _FIRST
        self._least = _GONE * sigma
        for k in range(self.most):
            if sigma > _STUCK * first:
                raise Unsettled(f"{k} steps led to where none leads on", missing)
            step = self._step(missing, sigma, tolerance)
            length = np.inf if step is None else self.stiffness.length(step)
            if self.progress is not None:
                self.progress(k, length)
            if step is None and near:
                return q  # so little of sigma that nothing is left of it
            if length < _ROUNDING and self._is_rounding(q, missing):
                return q
            if sigma <= self._least and self._is_rounding(q, missing, self.cancelled):
                return q  # what nothing pushes back goes by rounding
            ahead = None if step is None else self._ahead(q, step, missing)
            if ahead is None:
                sigma *= _HELD
                missing = self.stiffness.residual(q)
                continue
            self.steps, (q, missing) = self.steps + 1, ahead
            near = length <= tolerance and sigma <= first
            if near and sigma <= self._least:
                return q
            sigma = max(sigma / (_DROPPED if near else _EASED), self._least)
        raise Unsettled(f"not at rest after {self.most} steps", missing)

    def _step(self, missing: Array, sigma: float, tolerance: float) -> Array | None:
        """The step from the state whose residual has just been made; None where it is not known to
        go downhill, as far as that can be told, nor to be nothing."""
        stiffness = self.stiffness
        try:
            stiffness.factor(sigma)
            step = -stiffness.solve(missing)
        except Unsolved:
            self._least = _HELD * sigma
            return None
        except NumericalFailure:
            return None
        length = stiffness.length(step)
        if length > tolerance and stiffness.tangent.count_negative():
            return None
        return step / max(1.0, length / _LONGEST)

    def _ahead(self, q: Array, step: Array, missing: Array) -> tuple[Array, Array] | None:
        """q after a step, and what is missing there; None where no state is near, uphill, and
        beyond the bottom by much.  The tangent must be that of q: it turns a motion into a change
        of coordinates."""
        try:
            ahead = self.settled(q + self.stiffness.tangent.coordinates(step))
            left = self.stiffness.residual(ahead)
        except NumericalFailure:
            return None
        if self.stiffness.length(step) >= _ROUNDING:
            begun = float(missing @ step)
            if not begun < 0 or not float(left @ step) <= -0.5 * begun:
                return None
        return ahead, left

    def _is_rounding(self, q: Array, missing: Array, cancelled: float = 0.0) -> bool:
        """Whether what is missing is no more than what rounding of q makes of it, or of what
        cancels, J."""
        draw, noise = np.random.default_rng(0), cancelled / _MORE / self.stiffness.sizes
        for _ in range(_NUDGES):
            nudged = q * (1 + _NUDGE * draw.uniform(-1.0, 1.0, len(q)))
            noise = np.maximum(noise, np.abs(self.stiffness.residual(nudged) - missing))
        self.stiffness.residual(q)
        return bool((np.abs(missing) <= _MORE * noise).all())

    def _unrest(self, q: Array) -> float:
        """The largest acceleration, in sizes."""
        tangent, still = self.stiffness.tangent, self.stiffness.still
        one = np.array([self.stiffness.t]), q[None], still[None], tangent.memory[None]
        largest = self.stiffness.length(tangent.engine.accelerations(*one)[1][0])
        if not np.isfinite(largest):
            raise NumericalFailure("the accelerations of this state are not finite")
        return largest
