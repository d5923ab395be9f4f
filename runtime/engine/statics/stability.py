"""Unstable and neutral directions of a static equilibrium, in O(bodies).

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
from dataclasses import dataclass, field

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .shifted_stiffness import ShiftedStiffness

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
#: Relative perturbations of q that reveal rounding of a stiffness, their number, and a safety
#: factor.
_PERTURBATION, _PERTURBATION_COUNT, _SAFETY_FACTOR = 1e-14, 2, 10.0
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
        basis, inertia_products, matrix = (
            list[Array](),
            list[Array](),
            np.zeros((_MAX_VECTORS + 1, _MAX_VECTORS)),
        )
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
        random_generator, values = np.random.default_rng(0), list[float]()
        for k in range(1 + _PERTURBATION_COUNT):
            self.stiffness.residual(
                q
                * (1 + (_PERTURBATION if k else 0.0) * random_generator.uniform(-1.0, 1.0, len(q)))
            )
            values.append(
                float(
                    motion
                    @ self.stiffness.press(motion)
                    / (motion @ self.stiffness.inertia(motion))
                )
            )
        self.stiffness.residual(q)
        noise = max(abs(value - values[0]) for value in values[1:])
        return values[0], _SAFETY_FACTOR * noise
