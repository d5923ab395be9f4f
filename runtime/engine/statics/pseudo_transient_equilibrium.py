"""Static equilibrium by pseudo-transient continuation, O(bodies) per step.

    (K + sigma W) x = -R(q),   J x = 0

is a descent step if forces have a potential: R are the unbalanced efforts, K their derivatives, J
the rows of closed loops, and W the inertia with rotors on the hinges.  Equilibrium does not depend
on W, but the path to it does: with body inertia only, chains of many links under compression fold
up.  sigma, an inverse time squared, decreases while steps descend, so that the iteration ends as
Newton's method (Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508-523).  Each step factors the
tangent once.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .shifted_stiffness import ShiftedStiffness, SolutionIsRounding
from .static_equilibrium import EquilibriumNotFoundError

#: Default maximum number of steps.
MAX_STEPS = 2000
#: Longest step and first step, in characteristic scales of the coordinates.
_MAX_STEP, _FIRST_STEP = 0.5, 0.05
#: Factors by which sigma decreases after a descent step, and increases after a failed step.
_SIGMA_DECREASE, _SIGMA_INCREASE = 4.0, 4.0
#: The search fails if sigma exceeds this multiple of its first value.
_MAX_SIGMA_RATIO = 1e8
#: Step length, in characteristic scales, below which efforts may be rounding; factor by which sigma
#: decreases after steps within the tolerance; fraction of its first value that counts as zero.
_ROUNDING_STEP, _SIGMA_FAST_DECREASE, _MIN_SIGMA_RATIO = 1e-6, 64.0, 1e-20
#: Relative perturbations of q that reveal rounding, their number, and a safety factor.
_PERTURBATION, _PERTURBATION_COUNT, _SAFETY_FACTOR = 4e-16, 3, 10.0
#: Rounding error of efforts, relative to those that cancel.
_CANCELLATION_ROUNDING = 2e-16


class PseudoTransientEquilibrium:
    """Search for a static equilibrium from one state.

    `settled` corrects the drives, quaternions and loops of a state or raises NumericalFailure;
    `load` is the work (J) of all forces that may cancel, over characteristic motions; `progress` is
    called with the number of every step and its length in characteristic scales.
    """

    def __init__(
        self,
        stiffness: ShiftedStiffness,
        settled: Callable[[Array], Array],
        load: float,
        most: int = MAX_STEPS,
        progress: Callable[[int, float], None] | None = None,
    ) -> None:
        self.stiffness, self.consistent_state, self.max_steps, self.progress = (
            stiffness,
            settled,
            most,
            progress,
        )
        self.cancelled = _CANCELLATION_ROUNDING * load  #: J, for tests with the smallest sigma
        self.steps = 0  #: number of steps of the last search
        self._min_sigma = 0.0  # smallest sigma with solutions above rounding

    def find(self, q: Array, tolerance: float) -> Array:
        """Find q (nq,) at rest, to `tolerance` times the characteristic scales, or to rounding.

        Raises EquilibriumNotFoundError with the unbalanced efforts (nu,) after `max_steps` steps.
        """
        self.steps, q = 0, self.consistent_state(q)
        missing_efforts, is_near = self.stiffness.residual(q), False
        if self._is_rounding(q, missing_efforts):
            return q
        sigma = first_sigma = self._unrest(q) / _FIRST_STEP
        self._min_sigma = _MIN_SIGMA_RATIO * sigma
        for k in range(self.max_steps):
            if sigma > _MAX_SIGMA_RATIO * first_sigma:
                raise EquilibriumNotFoundError(
                    f"no further progress after {k} steps", missing_efforts
                )
            step = self._step(missing_efforts, sigma, tolerance)
            step_length = np.inf if step is None else self.stiffness.length(step)
            if self.progress is not None:
                self.progress(k, step_length)
            if step is None and is_near:
                return q  # sigma is negligible
            if step_length < _ROUNDING_STEP and self._is_rounding(q, missing_efforts):
                return q
            if sigma <= self._min_sigma and self._is_rounding(q, missing_efforts, self.cancelled):
                return q  # directions without stiffness move by rounding only
            next_state = None if step is None else self._state_after_step(q, step, missing_efforts)
            if next_state is None:
                sigma *= _SIGMA_INCREASE
                missing_efforts = self.stiffness.residual(q)
                continue
            self.steps, (q, missing_efforts) = self.steps + 1, next_state
            is_near = step_length <= tolerance and sigma <= first_sigma
            if is_near and sigma <= self._min_sigma:
                return q
            sigma = max(
                sigma / (_SIGMA_FAST_DECREASE if is_near else _SIGMA_DECREASE), self._min_sigma
            )
        raise EquilibriumNotFoundError(
            f"not converged after {self.max_steps} steps", missing_efforts
        )

    def _step(self, missing: Array, sigma: float, tolerance: float) -> Array | None:
        """Step from the state of the last residual, limited to `_MAX_STEP`.

        None if descent is uncertain, unless the step is within the tolerance.
        """
        stiffness = self.stiffness
        try:
            stiffness.factor(sigma)
            step = -stiffness.solve(missing)
        except SolutionIsRounding:
            self._min_sigma = _SIGMA_INCREASE * sigma
            return None
        except NumericalFailure:
            return None
        length = stiffness.length(step)
        if length > tolerance and stiffness.tangent.count_negative():
            return None
        return step / max(1.0, length / _MAX_STEP)

    def _state_after_step(
        self, q: Array, step: Array, missing: Array
    ) -> tuple[Array, Array] | None:
        """State q after a step, and the unbalanced efforts there.

        None if no valid state is near, if the step ascends, or if it passes the minimum far.  The
        tangent must be that of q: it converts a motion to a change of coordinates.
        """
        try:
            next_q = self.consistent_state(q + self.stiffness.tangent.coordinates(step))
            next_efforts = self.stiffness.residual(next_q)
        except NumericalFailure:
            return None
        if self.stiffness.length(step) >= _ROUNDING_STEP:
            initial_work = float(missing @ step)
            if not initial_work < 0 or not float(next_efforts @ step) <= -0.5 * initial_work:
                return None
        return next_q, next_efforts

    def _is_rounding(self, q: Array, missing: Array, cancelled: float = 0.0) -> bool:
        """True if unbalanced efforts are rounding errors of q or of cancelling efforts (J)."""
        random_generator, noise = (
            np.random.default_rng(0),
            cancelled / _SAFETY_FACTOR / self.stiffness.sizes,
        )
        for _ in range(_PERTURBATION_COUNT):
            perturbed_q = q * (1 + _PERTURBATION * random_generator.uniform(-1.0, 1.0, len(q)))
            noise = np.maximum(noise, np.abs(self.stiffness.residual(perturbed_q) - missing))
        self.stiffness.residual(q)
        return bool((np.abs(missing) <= _SAFETY_FACTOR * noise).all())

    def _unrest(self, q: Array) -> float:
        """Largest acceleration in characteristic scales."""
        tangent, zero_speeds = self.stiffness.tangent, self.stiffness.zero_speeds
        state = np.array([self.stiffness.t]), q[None], zero_speeds[None], tangent.memory[None]
        max_acceleration = self.stiffness.length(tangent.engine.accelerations(*state)[1][0])
        if not np.isfinite(max_acceleration):
            raise NumericalFailure("the accelerations of this state are not finite")
        return max_acceleration
