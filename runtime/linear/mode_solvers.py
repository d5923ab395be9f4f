"""Mode solvers of a linear model: dense matrices, or operators for large models."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import eig, eigh

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

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
    from . import shift_invert_modes

    pencil = linear.operators
    x = np.random.default_rng(0).standard_normal(len(linear))
    with_c = bool(pencil.damping(x).any()) if damped is None else damped
    if with_c or pencil.skew() > _SYMMETRIC:
        slowest = shift_invert_modes.damped_modes(pencil, count, with_c)
        return Modes(linear, slowest.values, slowest.shapes, None)
    slowest = shift_invert_modes.undamped_modes(pencil, count)
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
