"""Directions in which nothing holds a static equilibrium, in O(bodies).

Of the motions that loops leave, those with the least stiffness beside the inertia W are found by
Arnoldi's method with (K + sigma W)^-1 W (W. E. Arnoldi, Q. Appl. Math. 9 (1951) 17-29; Y. Saad,
Numerical Methods for Large Eigenvalue Problems, 2011, ch. 6): every eigenvalue kappa of K beside W
shows as 1 / (kappa + sigma), so that what is far below -sigma or near 0 stands apart.  As sigma
goes from the largest kappa down by factors, nothing negative is missed.  A direction counts as one
without stiffness only where its stiffness is what rounding of the state makes of it, however soft
it is beside others.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from .shifted_stiffness import ShiftedStiffness

#: Vectors of one sequence, and what is left of one that depends on others, in parts.
_VECTORS, _NOTHING = 16, 1e-10
#: sigma in parts of the largest kappa, one after the other; kappa that may be none, and how well
#: those and others agree with the stiffness of their motions where they are no rounding; kappa
#: beyond so many sigma are rounding of a sequence.
_SHIFTS = tuple(10.0**-k for k in range(0, 13, 2))
_SEEN = 1e3
_SOFT, _ALIKE, _NEAR = 1e-10, 1e-2, 0.5
#: A sigma so large that the inertia is alone, and powers of W^-1 K.
_ALONE, _POWERS = 1e200, 6
#: Changes of q, in parts, by which rounding of a stiffness is seen, how often, and how many times
#: it may be more.
_NUDGE, _NUDGES, _MORE = 1e-14, 2, 10.0
#: How far a stiffness is from symmetric that has no potential, in parts.
_SKEW = 1e-4


@dataclass(frozen=True)
class Stability:
    """Of an equilibrium: motions (nu,) along which it leaves itself, where efforts have a
    potential, and some, drawn at random, of those along which nothing pushes."""

    unstable: list[Array] = field(default_factory=list)
    neutral: list[Array] = field(default_factory=list)


def find_stability(stiffness: ShiftedStiffness, q: Array) -> Stability:
    """The stability of an equilibrium q (nq,)."""
    return _Search(stiffness).at(q)


class _Search:
    def __init__(self, stiffness: ShiftedStiffness) -> None:
        self.stiffness = stiffness

    def at(self, q: Array) -> Stability:
        self.stiffness.residual(q)
        largest = self._largest() or 1.0
        unstable, neutral, skewed = list[Array](), list[Array](), False
        for sigma in (largest * np.array(_SHIFTS)).tolist():
            found, skew = self._softest(sigma, _SOFT * largest)
            skewed |= skew
            for kappa, motion in found:
                own, noise = self._stiffness(q, motion)
                soft = abs(kappa) <= _SOFT * largest
                sure = abs(own - kappa) <= (_ALIKE if soft else _NEAR) * abs(own) > noise
                if sure and own < 0:
                    unstable.append(motion)
                elif not sure and (soft or abs(own) <= noise):
                    neutral.append(motion)
        return Stability([] if skewed else unstable, neutral)

    def _largest(self) -> float:
        """The size of the largest kappa: a few powers of W^-1 K."""
        self.stiffness.factor(_ALONE)
        motion, size = self._drawn(), 0.0
        for _ in range(_POWERS):
            before = self._size(motion)
            if not before > 0:
                break
            motion = _ALONE * self.stiffness.solve(self.stiffness.press(motion / before))
            size = self._size(motion)
        return size

    def _size(self, motion: Array) -> float:
        """Beside W."""
        return math.sqrt(max(0.0, float(motion @ self.stiffness.inertia(motion))))

    def _drawn(self) -> Array:
        """A motion that loops allow, by the tangent in hand."""
        draw = np.random.default_rng(0).standard_normal(len(self.stiffness.still))
        motion = self.stiffness.solve(draw)
        return np.asarray(motion / (float(np.abs(motion).max(initial=0.0)) or 1.0))

    def _softest(self, sigma: float, soft: float) -> tuple[list[tuple[complex, Array]], bool]:
        """Motions with kappa below `soft`, as far as this sigma shows them; is K skew?"""
        try:
            self.stiffness.factor(sigma)
            basis, matrix = self._sequence()
            values, vectors = np.linalg.eig(matrix)
        except (NumericalFailure, np.linalg.LinAlgError):
            return [], False
        with np.errstate(all="ignore"):
            kappas = 1.0 / values - sigma
        skew = np.abs(matrix - matrix.T).max(initial=0.0) > _SKEW * np.abs(matrix).max(initial=0.0)
        found = [
            (complex(kappa), (basis.T @ vector).real)
            for kappa, vector in zip(kappas, vectors.T, strict=True)
            if kappa.real <= soft and abs(kappa) < _SEEN * sigma
        ]  # fmt: skip
        return found, bool(skew)

    def _sequence(self) -> tuple[Array, Array]:
        """Motions (m, nu), orthonormal beside W, and (K + sigma W)^-1 W (m, m) among them."""
        basis, pushed, matrix = list[Array](), list[Array](), np.zeros((_VECTORS + 1, _VECTORS))
        motion, size = self._drawn(), 1.0
        for k in range(_VECTORS + 1):
            for _ in range(2 if k else 0):
                shares = np.array(pushed) @ motion
                matrix[:k, k - 1] += shares
                motion = motion - shares @ np.array(basis)
            inertia = self.stiffness.inertia(motion)
            left = math.sqrt(max(0.0, float(motion @ inertia)))
            if k == _VECTORS or not left > _NOTHING * size:
                break
            matrix[k, max(k - 1, 0)] += left if k else 0.0
            basis.append(motion / left)
            pushed.append(inertia / left)
            motion = self.stiffness.solve(pushed[-1])
            size = self._size(motion)
        n = len(basis)
        return np.array(basis).reshape(n, len(motion)), matrix[:n, :n]

    def _stiffness(self, q: Array, motion: Array) -> tuple[float, float]:
        """Of one motion beside its inertia, and what of it may be rounding of q."""
        draw, found = np.random.default_rng(0), list[float]()
        for k in range(1 + _NUDGES):
            self.stiffness.residual(
                q * (1 + (_NUDGE if k else 0.0) * draw.uniform(-1.0, 1.0, len(q)))
            )
            found.append(
                float(
                    motion
                    @ self.stiffness.press(motion)
                    / (motion @ self.stiffness.inertia(motion))
                )
            )
        self.stiffness.residual(q)
        noise = max(abs(one - found[0]) for one in found[1:])
        return found[0], _MORE * noise
