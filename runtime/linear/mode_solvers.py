"""Mode solvers of a linear model: dense matrices, or operators for large models."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig, eigh
from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .frozen_loads import with_springs_grounded
from .lanczos_iteration import ConvergedPairs, slowest
from .mck_matrices import Pencil
from .modes import Modes

if TYPE_CHECKING:
    from .linear_equations import LinearEquations


#: Number of coordinates above which the slowest modes are computed without matrices.
_DENSE = 400
#: Relative asymmetry above which a stiffness does not derive from a potential.
_SYMMETRIC = 1e-9
#: Rates that are rounding, relative to the largest: the error of omega^2 is its square.
_ROUNDING = 1e-7


def modes(linear: LinearEquations, count: int | None, damped: bool | None) -> Modes:
    """Modes of a linear model; see `Linear.modes`."""
    few = count is not None and len(linear) > _DENSE and 4 * count <= len(linear)
    few = few and linear.constrained_motion is None and linear.frame_transform is None
    if count is None or not few or linear.rate_matrix is not None:
        dense_modes = _dense(linear, damped)
        return dense_modes if count is None else replace(dense_modes.lowest(count), count=count)
    return replace(_lowest_modes(linear, count, damped), count=count)


def _lowest_modes(linear: LinearEquations, count: int, damped: bool | None) -> Modes:
    pencil = linear.operators
    x = np.random.default_rng(0).standard_normal(len(linear))
    with_c = bool(pencil.damping(x).any()) if damped is None else damped
    if with_c or pencil.skew() > _SYMMETRIC:
        slowest = damped_modes(pencil, count, with_c)
        return Modes(linear, slowest.values, slowest.shapes, None)
    slowest = undamped_modes(pencil, count)
    return _modes_from_squares(linear, slowest.values, slowest.shapes, slowest.is_complete)


def _dense(linear: LinearEquations, damped: bool | None) -> Modes:
    """All modes, from the matrices."""
    with_c = linear.C.any() if damped is None else damped
    if with_c or not _is_symmetric(linear.K):
        return _general(linear, linear.C if with_c else np.zeros_like(linear.C))
    return _modes_from_squares(linear, *_symmetric(linear), True)


def _modes_from_squares(
    linear: LinearEquations, squares: Array, shapes: Array, complete: bool | None
) -> Modes:
    """Modes from omega^2; a negative value gives the growing one of its two motions."""
    rates = np.sqrt(np.abs(squares))
    values = np.where(squares < 0, rates + 0j, 1j * rates)
    order = np.argsort(rates, kind="stable")
    return Modes(linear, values[order], shapes[:, order], complete)


def _is_symmetric(stiffness: Array) -> bool:
    scale = np.abs(stiffness).max(initial=0)
    return bool(np.abs(stiffness - stiffness.T).max(initial=0) <= _SYMMETRIC * scale)


def _symmetric(linear: LinearEquations) -> tuple[Array, Array]:
    stiffness, mass = (linear.K + linear.K.T) / 2, (linear.M + linear.M.T) / 2
    try:
        squares, shapes = eigh(stiffness, mass)
    except np.linalg.LinAlgError:
        raise _no_inertia(linear) from None
    rounding = (_ROUNDING**2) * np.abs(squares).max(initial=0)
    return np.where(np.abs(squares) <= rounding, 0.0, squares), shapes


def _general(linear: LinearEquations, c: Array) -> Modes:
    """Modes of the quadratic eigenvalue problem, reduced to first order."""
    n = len(linear)
    zero, identity = np.zeros((n, n)), np.eye(n)
    a = np.block([[zero, identity], [-linear.K, -c]])
    b = np.block([[identity, zero], [zero, linear.M]])
    pairs: Any = eig(a, b)
    values, vectors = pairs
    if not np.isfinite(values).all():
        raise _no_inertia(linear)
    rounding = _ROUNDING * np.abs(values).max(initial=0)
    values = np.where(np.abs(np.imag(values)) <= rounding, np.real(values), values)
    values = np.where(np.abs(np.real(values)) <= rounding, 1j * np.imag(values), values)
    kept = np.flatnonzero(np.imag(values) >= 0)
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")]
    shapes = vectors[:n, kept]
    largest_rows = np.abs(shapes).argmax(axis=0)
    shapes = shapes / shapes[largest_rows, np.arange(len(kept))]
    return Modes(linear, values[kept].astype(np.complex128), shapes, True)


def _no_inertia(linear: LinearEquations) -> NumericalFailure:
    names = ", ".join(linear.coordinate_names[:3])
    return NumericalFailure(
        f"modes: the mass matrix of {names}, ... is not positive definite, so that a mode has "
        "no frequency; give the bodies that they move inertia"
    )


# --- slowest modes of large models, by shift-and-invert iteration ---------------------------------
#
#     (K - sigma M)^-1 M x = x / (omega^2 - sigma)
#
# yields the modes with omega^2 nearest to sigma first (Ericsson and Ruhe, Math. Comp. 35 (1980)
# 1251-1268).  The pivots of one more factorisation count the modes, so that none of an undamped
# scene is missed.  Damped modes result from the inverse of the first-order problem and are not
# counted.

#: Additional modes, so that the count finds a gap above the last requested one.
_BEYOND = 2
#: Candidate shifts for an unrestrained scene, relative to the largest omega^2.
_SHIFTS = tuple(10.0**-k for k in range(24, 1, -1))
#: Index of the shift that is used if modes are not counted.
_UNCOUNTED = 12
#: Largest relative residual of a solution with a usable factorisation.
_NOISE = 1e-6
#: Fraction of the shift below which omega^2 is rounding, as for unrestrained modes.
_SHIFT_ROUNDING = 1e-2
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
        values = np.where(np.abs(pairs.squares) <= _SHIFT_ROUNDING * abs(sigma), 0.0, pairs.squares)
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


# --- number of modes of an undamped scene below a frequency ---------------------------------------
#
# The number of omega^2 below `square` is the number of negative eigenvalues of K - square M, which
# for a tree is that of the pivots of its sweep (Sylvester; Wittrick and Williams, Q. J. Mech. Appl.
# Math. 24 (1971) 263-284).
#
# The pivots do not include the coupling by springs between bodies.  Let A be K - square M and T the
# same matrix of the tree with these springs connected to the ground (`with_springs_grounded`).
# Both are symmetric if loads have a potential, and A - T has low rank.  If the columns of W span
# T^-1 (A - T), then A x = T x for every x with W^T T x = 0, so that such x are not coupled with W
# (Haynsworth, Linear Algebra Appl. 1 (1968) 73-81):
#
#     negative(A) = negative(T) + negative(W^T A W) - negative(W^T T W).

#: Upper bound of the rank of the stiffness of one spring between two bodies.
_SPRING_RANK = 12
#: Relative size below which a column is linearly dependent, and relative asymmetry above which a
#: matrix does not count as symmetric.
_NEW, _SYMMETRIC_PART = 1e-12, 1e-6


class ModeCounter:
    """Counter of the modes of one scene."""

    def __init__(self, pencil: Pencil) -> None:
        self.full_pencil = self.tree = pencil
        if pencil.tangent.off_tree_count:
            apart = with_springs_grounded(pencil.tangent.engine, pencil.state)
            self.tree = Pencil(apart, pencil.state, pencil.free.tolist())

    def count_below(self, square: float) -> int | None:
        """Number of omega^2 below `square`.

        None if loads other than springs couple branches of the tree, or have no potential.
        """
        efforts = self._efforts
        self.tree.factor(-square)
        count = self.tree.tangent.count_negative()
        if count is None or not efforts.size:
            return count
        more = self._count_difference(
            square, _basis([self.tree.solve(column) for column in efforts.T])
        )
        return None if more is None else count + more

    @cached_property
    def _efforts(self) -> Array:
        """Basis (n, r) of the coupling efforts of springs between bodies.

        It is found from random displacements, as many as the rank of the coupling can be.
        """
        n = len(self.full_pencil)
        if self.tree is self.full_pencil:
            return np.zeros((n, 0))
        forces = len(self.tree.tangent.engine.packed.system.forces)
        moves = np.random.default_rng(0).standard_normal((min(n, _SPRING_RANK * forces), n))
        return _basis([self.full_pencil.stiffness(x) - self.tree.stiffness(x) for x in moves])

    def _count_difference(self, square: float, w: Array) -> int | None:
        """Number of negative eigenvalues of A less that of T; None if either is not symmetric."""
        counts = []
        for pencil in (self.full_pencil, self.tree):
            pressed = [pencil.stiffness(x) - square * pencil.mass(x) for x in w.T]
            matrix = w.T @ np.array(pressed).T
            if np.abs(matrix - matrix.T).max() > _SYMMETRIC_PART * np.abs(matrix).max():
                return None
            counts.append(int((np.linalg.eigvalsh((matrix + matrix.T) / 2) < 0).sum()))
        return counts[0] - counts[1]


def _basis(columns: list[Array]) -> Array:
    """Orthonormal basis (n, r) of columns (n,)."""
    left, sizes, _ = np.linalg.svd(np.array(columns).T, full_matrices=False)
    return left[:, sizes > _NEW * sizes.max(initial=0)]
