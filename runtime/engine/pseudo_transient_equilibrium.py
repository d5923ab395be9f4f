"""Static equilibrium and its stability in O(bodies) per step.

Pseudo-transient continuation solves

    (K + sigma W) x = -R(q),   J x = 0

which is a descent step if forces have a potential: R are the unbalanced efforts, K their
derivatives, J the rows of closed loops, and W the inertia with rotors on the hinges.  Equilibrium
does not depend on W, but the path to it does: with body inertia only, chains of many links under
compression fold up.  sigma, an inverse time squared, decreases while steps descend, so that the
iteration ends as Newton's method (Kelley and Keyes, SIAM J. Numer. Anal. 35 (1998) 508-523).  Each
step factors the tangent once.

Of the motions that loops permit, those with the least stiffness relative to the inertia W are found
by Arnoldi's method with (K + sigma W)^-1 W (W. E. Arnoldi, Q. Appl. Math. 9 (1951) 17-29; Y. Saad,
Numerical Methods for Large Eigenvalue Problems, 2011, ch. 6): every eigenvalue kappa of K relative
to W appears as 1 / (kappa + sigma), which separates eigenvalues far below -sigma or near 0.  Since
sigma decreases from the largest kappa by factors, no negative eigenvalue is missed.  However soft a
direction is relative to others, it counts as neutral only if its stiffness is a rounding error of
the state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .static_equilibrium import EquilibriumNotFoundError
from .tangent_matrix import TangentMatrix

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
        system = tangent.engine.packed.system
        first_speeds = tangent.engine.packed.system.first_indices["u"]
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
        self.stiffness = stiffness
        self.consistent_state = settled
        self.max_steps = most
        self.progress = progress
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
        random_generator = np.random.default_rng(0)
        noise = cancelled / _SAFETY_FACTOR / self.stiffness.sizes
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


#: Maximum number of vectors of one Arnoldi sequence, and relative remainder below which a vector is
#: linearly dependent.
_MAX_VECTORS, _MIN_REMAINDER = 16, 1e-10
#: Successive sigma relative to the largest kappa.  Eigenvalues kappa beyond `_MAX_KAPPA_RATIO`
#: sigma are rounding errors of a sequence.  Kappa up to `_NEUTRAL_RATIO` of the largest one may be
#: zero; unless they are rounding errors, these agree with the stiffness of their motions to
#: `_SOFT_AGREEMENT`, others to `_MIN_AGREEMENT`.
_SHIFTS = tuple(10.0**-k for k in range(0, 13, 2))
_MAX_KAPPA_RATIO = 1e3
_NEUTRAL_RATIO, _SOFT_AGREEMENT, _MIN_AGREEMENT = 1e-10, 1e-2, 0.5
#: Value of sigma at which the stiffness is negligible, and number of powers of W^-1 K.
_LARGE_SIGMA, _POWER_STEPS = 1e200, 6
#: Relative perturbations of q that reveal rounding of a stiffness, and their number.
_STIFFNESS_PERTURBATION, _STIFFNESS_PERTURBATION_COUNT = 1e-14, 2
#: Relative asymmetry above which a stiffness has no potential.
_MAX_ASYMMETRY = 1e-4


@dataclass(frozen=True)
class Stability:
    """Unstable and neutral motions (nu,) of an equilibrium.

    Unstable motions are found only if efforts have a potential; neutral motions are a random
    selection.
    """

    unstable: list[Array] = field(default_factory=list)
    neutral: list[Array] = field(default_factory=list)


def find_stability(stiffness: ShiftedStiffness, q: Array) -> Stability:
    """Find the unstable and neutral motions of an equilibrium q (nq,)."""
    return _StabilitySearch(stiffness).evaluate(q)


class _StabilitySearch:
    def __init__(self, stiffness: ShiftedStiffness) -> None:
        self.stiffness = stiffness

    def evaluate(self, q: Array) -> Stability:
        self.stiffness.residual(q)
        largest = self._largest() or 1.0
        unstable, neutral, is_skew = list[Array](), list[Array](), False
        for sigma in (largest * np.array(_SHIFTS)).tolist():
            soft_motions, is_matrix_skew = self._softest(sigma, _NEUTRAL_RATIO * largest)
            is_skew |= is_matrix_skew
            for kappa, motion in soft_motions:
                stiffness, noise = self._stiffness(q, motion)
                is_soft = abs(kappa) <= _NEUTRAL_RATIO * largest
                is_certain = (
                    abs(stiffness - kappa)
                    <= (_SOFT_AGREEMENT if is_soft else _MIN_AGREEMENT) * abs(stiffness)
                    > noise
                )
                if is_certain and stiffness < 0:
                    unstable.append(motion)
                elif not is_certain and (is_soft or abs(stiffness) <= noise):
                    neutral.append(motion)
        return Stability([] if is_skew else unstable, neutral)

    def _largest(self) -> float:
        """Magnitude of the largest kappa, by power iteration with W^-1 K."""
        self.stiffness.factor(_LARGE_SIGMA)
        motion, size = self._random_motion(), 0.0
        for _ in range(_POWER_STEPS):
            norm = self._size(motion)
            if not norm > 0:
                break
            motion = _LARGE_SIGMA * self.stiffness.solve(self.stiffness.press(motion / norm))
            size = self._size(motion)
        return size

    def _size(self, motion: Array) -> float:
        """Norm of a motion with the inertia W."""
        return math.sqrt(max(0.0, float(motion @ self.stiffness.inertia(motion))))

    def _random_motion(self) -> Array:
        """Random motion that loops permit, by the current factorisation."""
        random_efforts = np.random.default_rng(0).standard_normal(len(self.stiffness.zero_speeds))
        motion = self.stiffness.solve(random_efforts)
        return np.asarray(motion / (float(np.abs(motion).max(initial=0.0)) or 1.0))

    def _softest(self, sigma: float, soft: float) -> tuple[list[tuple[complex, Array]], bool]:
        """Motions with kappa below `soft` found with this sigma, and whether K is asymmetric."""
        try:
            self.stiffness.factor(sigma)
            basis, matrix = self._sequence()
            values, vectors = np.linalg.eig(matrix)
        except (NumericalFailure, np.linalg.LinAlgError):
            return [], False
        with np.errstate(all="ignore"):
            kappas = 1.0 / values - sigma
        skew = np.abs(matrix - matrix.T).max(initial=0.0) > _MAX_ASYMMETRY * np.abs(matrix).max(
            initial=0.0
        )
        motions = [
            (complex(kappa), (basis.T @ vector).real)
            for kappa, vector in zip(kappas, vectors.T, strict=True)
            if kappa.real <= soft and abs(kappa) < _MAX_KAPPA_RATIO * sigma
        ]  # fmt: skip
        return motions, bool(skew)

    def _sequence(self) -> tuple[Array, Array]:
        """Motions (m, nu), W-orthonormal, and (K + sigma W)^-1 W (m, m) in this basis."""
        basis = list[Array]()
        inertia_products = list[Array]()
        matrix = np.zeros((_MAX_VECTORS + 1, _MAX_VECTORS))
        motion, size = self._random_motion(), 1.0
        for k in range(_MAX_VECTORS + 1):
            for _ in range(2 if k else 0):
                components = np.array(inertia_products) @ motion
                matrix[:k, k - 1] += components
                motion = motion - components @ np.array(basis)
            inertia = self.stiffness.inertia(motion)
            remainder = math.sqrt(max(0.0, float(motion @ inertia)))
            if k == _MAX_VECTORS or not remainder > _MIN_REMAINDER * size:
                break
            matrix[k, max(k - 1, 0)] += remainder if k else 0.0
            basis.append(motion / remainder)
            inertia_products.append(inertia / remainder)
            motion = self.stiffness.solve(inertia_products[-1])
            size = self._size(motion)
        n = len(basis)
        return np.array(basis).reshape(n, len(motion)), matrix[:n, :n]

    def _stiffness(self, q: Array, motion: Array) -> tuple[float, float]:
        """Stiffness of a motion relative to its inertia, and its rounding error due to q."""
        draw, values = np.random.default_rng(0), list[float]()
        for k in range(1 + _STIFFNESS_PERTURBATION_COUNT):
            change = (_STIFFNESS_PERTURBATION if k else 0.0) * draw.uniform(-1.0, 1.0, len(q))
            self.stiffness.residual(q * (1 + change))
            work = motion @ self.stiffness.press(motion)
            values.append(float(work / (motion @ self.stiffness.inertia(motion))))
        self.stiffness.residual(q)
        noise = max(abs(value - values[0]) for value in values[1:])
        return values[0], _SAFETY_FACTOR * noise
