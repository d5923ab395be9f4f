"""Finite elements of a beam with shear (Timoshenko): deflection v cubic, rotation psi quadratic.

Unknowns: v and psi of each node, as v and v' of elements without shear, then three per element: two
of v and one of psi.  Every v' is the psi of some unknowns, so that thin elements do not lock.
Elements are exact for loads at nodes; frequencies converge with the fourth power of their length.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.array_validation import Array

from .shape_functions import ShearedShape

#: Coefficients of 1, xi, xi^2, xi^3 in v and in psi for unit unknowns of an element, xi = 0..1.
_V = np.array(
    [[1, -1, 0, 0], [0] * 4, [0, 1, 0, 0], [0] * 4, [0, 1, -1, 0], [0, 0, 1, -1], [0] * 4]
)
_PSI = np.array([[0] * 4, [1, -1, 0, 0], [0] * 4, [0, 1, 0, 0], [0] * 4, [0] * 4, [0, 1, -1, 0]])
#: int xi^i xi^j dxi from 0 to 1.
_PRODUCTS = 1 / (1 + np.add.outer(np.arange(4), np.arange(4)))


def timoshenko_matrices(
    nodes: Array, bending: Array, shear: Array, mass: Array, inertia: Array
) -> tuple[Array, Array]:
    """Stiffness and mass matrix of elements between `nodes` (m).

    Per element: E I (N m^2), k G A (N), mass (kg/m) and rotary inertia (kg m) per length.
    """
    size = 5 * len(nodes) - 3
    k, m = np.zeros((size, size)), np.zeros((size, size))
    for i, (h, unknowns) in enumerate(_elements(nodes)):
        strain = _derivative(_V) / h - _PSI
        entries = np.ix_(unknowns, unknowns)
        k[entries] += bending[i] / h * _integral(_derivative(_PSI))
        k[entries] += shear[i] * h * _integral(strain)
        m[entries] += mass[i] * h * _integral(_V) + inertia[i] * h * _integral(_PSI)
    return k, m


def sheared_shape(nodes: Array, u: Array) -> ShearedShape:
    """Deflection and rotation of the sections for unknowns `u`."""
    coefficients = np.array([
        [unit.T @ u[unknowns] / h ** np.arange(4) for unit in (_V, _PSI)]
        for h, unknowns in _elements(nodes)
    ])  # fmt: skip
    return ShearedShape(nodes, coefficients[:, 0], coefficients[:, 1])


def condense_statically(k: Array, m: Array, size: int) -> tuple[Array, Array]:
    """Matrices of the first `size` unknowns; the others follow statically."""
    motion = np.vstack([np.eye(size), -np.linalg.solve(k[size:, size:], k[size:, :size])])
    return motion.T @ k @ motion, motion.T @ m @ motion


def _elements(nodes: Array) -> Iterator[tuple[float, list[int]]]:
    """Length (m) of each element and its seven unknowns."""
    for i, h in enumerate(np.diff(nodes)):
        inner = 2 * len(nodes) + 3 * i
        yield float(h), [*range(2 * i, 2 * i + 4), *range(inner, inner + 3)]


def _derivative(coefficients: Array) -> Array:
    """Coefficients of the derivative by xi."""
    return np.hstack([coefficients[:, 1:] * np.arange(1, 4), np.zeros((len(coefficients), 1))])


def _integral(coefficients: Array) -> Array:
    """Integrals (7, 7) of products of two functions over xi."""
    return np.asarray(coefficients @ _PRODUCTS @ coefficients.T)
