"""Slowest modes of large models, by shift-and-invert iteration with the O(bodies) solution.

    (K - sigma M)^-1 M x = x / (omega^2 - sigma)

yields the modes with omega^2 nearest to sigma first (Ericsson and Ruhe, Math. Comp. 35 (1980)
1251-1268).  The pivots of one more factorisation count the modes, so that none of an undamped scene
is missed.  Damped modes result from the inverse of the first-order problem and are not counted.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .lanczos_iteration import ConvergedPairs, slowest
from .matrix_operators import Pencil
from .mode_count import ModeCounter

#: Additional modes, so that the count finds a gap above the last requested one.
_BEYOND = 2
#: Candidate shifts for an unrestrained scene, relative to the largest omega^2.
_SHIFTS = tuple(10.0**-k for k in range(24, 1, -1))
#: Index of the shift that is used if modes are not counted.
_UNCOUNTED = 12
#: Largest relative residual of a solution with a usable factorisation.
_NOISE = 1e-6
#: Fraction of the shift below which omega^2 is rounding, as for unrestrained modes.
_ROUNDING = 1e-2
#: Largest number of searches; each finds one more of several modes with equal frequencies.
_TRIALS = 12
#: Smallest gap between omega^2 that a count can separate, relative to the larger.
_GAP = 1e-9


@dataclass(frozen=True)
class LowestModes:
    """Slowest modes: omega^2 or eigenvalues (k,) and shapes (n, k).

    `is_complete` says whether no mode below the last one is missing; None if not counted.
    """

    values: NDArray[Any]
    shapes: NDArray[Any]
    is_complete: bool | None


def undamped_modes(pencil: Pencil, count: int) -> LowestModes:
    """The `count` modes of smallest omega^2 of M and a symmetric K; says if one is missing."""
    n, counting = len(pencil), ModeCounter(pencil)
    mode_count, sigma = min(count + _BEYOND, n - 1), _shift(pencil, counting)
    pairs, edge, values = ConvergedPairs.empty(n), np.inf, np.zeros(0)
    for trial in range(_TRIALS):
        pairs = slowest(pencil, mode_count, sigma, edge, trial, pairs)
        values = np.where(np.abs(pairs.squares) <= _ROUNDING * abs(sigma), 0.0, pairs.squares)
        kept, edge = _spectral_gap(values, count)
        counted = counting.count_below(edge)
        if counted is None or counted == kept:
            complete = None if counted is None else True
            return LowestModes(values[:count], pairs.shapes[:, :count], complete)
        mode_count = counted - kept
        if counted < kept:  # spurious modes were found: repeat with a shift that separates them
            pairs, sigma = ConvergedPairs.empty(n), min(sigma, edge - abs(edge))
            mode_count, edge = min(count + _BEYOND, n - 1), np.inf
    return LowestModes(values[:count], pairs.shapes[:, :count], False)


def _spectral_gap(values: Array, count: int) -> tuple[int, float]:
    """Number of values below the first gap at or after the last requested one, and its centre."""
    for k in range(max(1, min(count, len(values) - 1)), len(values)):
        below, above = float(values[k - 1]), float(values[k])
        if above - below > _GAP * max(abs(above), abs(below)):
            return k, (above + below) / 2
    last = float(values[-1])
    return len(values), last + _GAP * abs(last)


def _shift(pencil: Pencil, counting: ModeCounter) -> float:
    """Shift sigma: 0 if the scene is restrained, else negative.

    Its magnitude suffices for a usable factorisation, and is as large as possible below the omega^2
    of all restrained modes.
    """
    if _is_usable(pencil, 0.0):
        return 0.0
    shifts = (np.array(_SHIFTS) * _fastest(pencil)).tolist()
    first = next((k for k in range(0, len(shifts), 4) if _is_usable(pencil, shifts[k])), _UNCOUNTED)
    still = counting.count_below(shifts[first])
    if still is None:
        return -shifts[_UNCOUNTED]
    more = bisect_left(shifts, True, first, key=lambda shift: counting.count_below(shift) != still)
    return -shifts[max(first, more - 1)]


def _is_usable(pencil: Pencil, shift: float) -> bool:
    """Whether the factorisation of K + shift M is usable: its solution has a small residual."""
    try:
        pencil.factor(shift)
    except NumericalFailure:
        return False
    b = pencil.mass(np.random.default_rng(0).standard_normal(len(pencil)))
    x = pencil.solve(b)
    left = pencil.stiffness(x) + shift * pencil.mass(x) - b
    return float(np.linalg.norm(left)) <= _NOISE * float(np.linalg.norm(b))


def _fastest(pencil: Pencil) -> float:
    """Magnitude of the largest omega^2, by a few power iterations with M^-1 K."""
    x = np.random.default_rng(0).standard_normal(len(pencil))
    pencil.factor(1e30)  # so that M dominates
    for _ in range(2):
        pressed = pencil.stiffness(x / np.linalg.norm(x))
        x = 1e30 * pencil.solve(pressed)
    return float(np.linalg.norm(x))


def damped_modes(pencil: Pencil, count: int, with_c: bool) -> LowestModes:
    """The `count` eigenvalues nearest to 0 of M, C (if `with_c`) and K; pairs count once."""
    n, c = len(pencil), pencil.damping if with_c else np.zeros_like
    try:
        pencil.factor(0.0)
        sigma = 0.0
    except NumericalFailure:
        sigma = np.sqrt(_SHIFTS[_UNCOUNTED] * _fastest(pencil))
        pencil.factor(sigma**2, sigma if with_c else 0.0)

    def inverse(b: Array) -> Array:
        b = np.ravel(b)
        first, second = b[:n], b[n:]
        pressed = sigma * pencil.mass(first) + c(first) + pencil.mass(second)
        x = -pencil.solve(pressed)
        return np.concatenate([x, sigma * x + first])

    operator = LinearOperator((2 * n, 2 * n), matvec=inverse, dtype=np.float64)
    k = min(2 * count + 4 * _BEYOND, 2 * n - 2)
    start = np.random.default_rng(0).standard_normal(2 * n)
    try:
        eigenpairs: Any = eigs(operator, k=k, v0=start, ncv=min(2 * n, 2 * k + 20))
    except ArpackError as error:
        raise NumericalFailure(f"modes: the iteration broke down ({error})") from None
    inverses, vectors = eigenpairs
    values = sigma + 1 / inverses
    kept = np.flatnonzero(values.imag >= -1e-9 * np.abs(values))
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")][:count]
    shapes = vectors[:n, kept]
    largest_rows = np.abs(shapes).argmax(axis=0)
    return LowestModes(values[kept], shapes / shapes[largest_rows, np.arange(len(kept))], None)
