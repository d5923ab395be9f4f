"""The slowest motions of many bodies, by shift and invert over the O(bodies) solution.

    (K - sigma M)^-1 M x = x / (omega^2 - sigma)

has the motions with omega^2 next to sigma first (Ericsson and Ruhe, Math. Comp. 35 (1980)
1251-1268), and the pivots of one more factorisation count how many there are, so that none of an
undamped scene is missed.  Damped motions come from the inverse of the first-order problem,
uncounted.
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
from .mode_count import Counting

#: Motions looked for beyond those asked for, so that the count has a gap behind the last one.
_BEYOND = 2
#: Parts of the fastest omega^2 by which a scene that nothing holds may be shifted.
_SHIFTS = tuple(10.0**-k for k in range(24, 1, -1))
#: Which of them is taken where motions are not counted.
_UNCOUNTED = 12
#: Efforts that a solution leaves, in parts, where the factors are no rounding.
_NOISE = 1e-6
#: Parts of that shift that are rounding: omega^2 of motions that nothing holds.
_ROUNDING = 1e-2
#: Searches at most; each finds one more of motions with equal frequencies.
_TRIALS = 12
#: omega^2 that are told apart by a count, in parts of the larger.
_GAP = 1e-9


@dataclass(frozen=True)
class LowestModes:
    """omega^2 (k,) or eigenvalues, shapes (n, k), and whether none is missing below the last (None:
    not counted)."""

    values: NDArray[Any]
    shapes: NDArray[Any]
    complete: bool | None


def undamped_modes(pencil: Pencil, count: int) -> LowestModes:
    """The `count` motions of least omega^2 of M and a symmetric K."""
    n, counting = len(pencil), Counting(pencil)
    wanted, sigma = min(count + _BEYOND, n - 1), _shift(pencil, counting)
    found, edge, values = ConvergedPairs.none(n), np.inf, np.zeros(0)
    for trial in range(_TRIALS):
        found = slowest(pencil, wanted, sigma, edge, trial, found)
        values = np.where(np.abs(found.squares) <= _ROUNDING * abs(sigma), 0.0, found.squares)
        kept, edge = _gap(values, count)
        counted = counting.below(edge)
        if counted is None or counted == kept:
            complete = None if counted is None else True
            return LowestModes(values[:count], found.shapes[:, :count], complete)
        wanted = counted - kept
        if counted < kept:  # some were found that are none: nearer to the shift they tell apart
            found, sigma = ConvergedPairs.none(n), min(sigma, edge - abs(edge))
            wanted, edge = min(count + _BEYOND, n - 1), np.inf
    return LowestModes(values[:count], found.shapes[:, :count], False)


def _gap(values: Array, count: int) -> tuple[int, float]:
    """How many of the values found are below a number between two of them, from the last that was
    asked for on, and that number."""
    for k in range(max(1, min(count, len(values) - 1)), len(values)):
        below, above = float(values[k - 1]), float(values[k])
        if above - below > _GAP * max(abs(above), abs(below)):
            return k, (above + below) / 2
    last = float(values[-1])
    return len(values), last + _GAP * abs(last)


def _shift(pencil: Pencil, counting: Counting) -> float:
    """0 where something holds the scene, else below 0: by so much that a factorisation is more than
    rounding, and by as much more as no motion that something holds is as slow."""
    if _told(pencil, 0.0):
        return 0.0
    shifts = (np.array(_SHIFTS) * _fastest(pencil)).tolist()
    first = next((k for k in range(0, len(shifts), 4) if _told(pencil, shifts[k])), _UNCOUNTED)
    still = counting.below(shifts[first])
    if still is None:
        return -shifts[_UNCOUNTED]
    more = bisect_left(shifts, True, first, key=lambda shift: counting.below(shift) != still)
    return -shifts[max(first, more - 1)]


def _told(pencil: Pencil, shift: float) -> bool:
    """Whether K + shift M is more than rounding: what it solves, it solves."""
    try:
        pencil.factor(shift)
    except NumericalFailure:
        return False
    b = pencil.mass(np.random.default_rng(0).standard_normal(len(pencil)))
    x = pencil.solve(b)
    left = pencil.stiffness(x) + shift * pencil.mass(x) - b
    return float(np.linalg.norm(left)) <= _NOISE * float(np.linalg.norm(b))


def _fastest(pencil: Pencil) -> float:
    """The size of the larger omega^2: a few powers of M^-1 K."""
    x = np.random.default_rng(0).standard_normal(len(pencil))
    pencil.factor(1e30)  # the mass alone
    for _ in range(2):
        pressed = pencil.stiffness(x / np.linalg.norm(x))
        x = 1e30 * pencil.solve(pressed)
    return float(np.linalg.norm(x))


def damped_modes(pencil: Pencil, count: int, with_c: bool) -> LowestModes:
    """The `count` eigenvalues (pairs count as one) next to 0 of M, C (or none) and K."""
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
        found: Any = eigs(operator, k=k, v0=start, ncv=min(2 * n, 2 * k + 20))
    except ArpackError as error:
        raise NumericalFailure(f"modes: the iteration broke down ({error})") from None
    inverses, vectors = found
    values = sigma + 1 / inverses
    kept = np.flatnonzero(values.imag >= -1e-9 * np.abs(values))
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")][:count]
    shapes = vectors[:n, kept]
    places = np.abs(shapes).argmax(axis=0)
    return LowestModes(values[kept], shapes / shapes[places, np.arange(len(kept))], None)
