"""Static equilibrium by pseudo-transient continuation with the factored tangent, O(bodies) a step.

    (K + sigma W) x = -R(q),   J x = 0

is a step of descent if forces have a potential: R are the efforts that equilibrium lacks, K their
derivatives, J the rows of closed loops, and W the inertia with rotors on the hinges.  Equilibrium
does not depend on W, but the path to it does: with the inertia of bodies only, chains of many links
under compression fold up.  sigma, an inverse time squared, decreases while steps descend, so that
the iteration ends as Newton's method (Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508-523).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from .rest import Unsettled
from .shifted_stiffness import ShiftedStiffness, Unsolved

#: Default maximum number of steps.
MOST = 2000
#: Longest step and first step, in characteristic scales of the coordinates.
_LONGEST, _FIRST = 0.5, 0.05
#: Factors by which sigma decreases after a step of descent, and increases after a failed step.
_EASED, _HELD = 4.0, 4.0
#: The search fails if sigma exceeds this multiple of its first value.
_STUCK = 1e8
#: Steps, in characteristic scales, below which efforts may be rounding; factor by which sigma
#: decreases after steps within the tolerance; fraction of its first value that counts as zero.
_ROUNDING, _DROPPED, _GONE = 1e-6, 64.0, 1e-20
#: Relative changes of q that reveal rounding, their number, and a safety factor.
_NUDGE, _NUDGES, _MORE = 4e-16, 3, 10.0
#: Rounding of efforts, relative to those that cancel.
_CANCELLED = 2e-16


class RestBySweep:
    """Search for a static equilibrium from one state.

    `settled` corrects the drives, quaternions and loops of a state or raises NumericalFailure,
    `load` is the work, J, of all forces that may cancel, over characteristic motions; `progress` is
    called with the number of every step and its length in characteristic scales.
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
        self.cancelled = _CANCELLED * load  #: J, for tests with the smallest sigma
        self.steps = 0  #: number of steps of the last search
        self._least = 0.0  # smallest sigma with which solutions are no rounding

    def find(self, q: Array, tolerance: float) -> Array:
        """Find q (nq,) at rest, to `tolerance` times the characteristic scales, or to rounding.

        Raises Unsettled with the missing efforts (nu,) after `most` steps.
        """
        self.steps, q = 0, self.settled(q)
        missing, near = self.stiffness.residual(q), False
        if self._is_rounding(q, missing):
            return q
        sigma = first = self._unrest(q) / _FIRST
        self._least = _GONE * sigma
        for k in range(self.most):
            if sigma > _STUCK * first:
                raise Unsettled(f"after {k} steps no further step leads on", missing)
            step = self._step(missing, sigma, tolerance)
            length = np.inf if step is None else self.stiffness.length(step)
            if self.progress is not None:
                self.progress(k, length)
            if step is None and near:
                return q  # sigma is negligible
            if length < _ROUNDING and self._is_rounding(q, missing):
                return q
            if sigma <= self._least and self._is_rounding(q, missing, self.cancelled):
                return q  # directions without stiffness move by rounding only
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
        """Step from the state of the last residual, at most _LONGEST long.

        None if it is not certain that it descends, unless it is within the tolerance.
        """
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
        """State q after a step, and the missing efforts there.

        None if no valid state is near, if the step ascends, or if it passes the minimum far.  The
        tangent must be that of q: it converts a motion to a change of coordinates.
        """
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
        """True if the missing efforts are rounding of q, or of cancelling efforts (J)."""
        draw, noise = np.random.default_rng(0), cancelled / _MORE / self.stiffness.sizes
        for _ in range(_NUDGES):
            nudged = q * (1 + _NUDGE * draw.uniform(-1.0, 1.0, len(q)))
            noise = np.maximum(noise, np.abs(self.stiffness.residual(nudged) - missing))
        self.stiffness.residual(q)
        return bool((np.abs(missing) <= _MORE * noise).all())

    def _unrest(self, q: Array) -> float:
        """Largest acceleration in characteristic scales."""
        tangent, still = self.stiffness.tangent, self.stiffness.still
        one = np.array([self.stiffness.t]), q[None], still[None], tangent.memory[None]
        largest = self.stiffness.length(tangent.engine.accelerations(*one)[1][0])
        if not np.isfinite(largest):
            raise NumericalFailure("the accelerations of this state are not finite")
        return largest
