"""Lagrange's equations of one rigid body behind a hinge on the ground, integrated by SciPy.

Knows nothing of subspaces or sweeps: the energies are written in the coordinates and their rates.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


def lagrange_motion(
    rotation: sp.Matrix,
    position: sp.Matrix,
    coordinates: Sequence[sp.Symbol],
    body: dict[str, Any],
    gravity: Sequence[float],
    start: tuple[Sequence[float], Sequence[float]],
    times: Array,
) -> Array:
    """q (times, n) from q and its rates at the start.

    `body` holds mass, center_of_mass and inertia (3 x 3, about the mass centre).
    """
    right = _right_hand_side(rotation, position, coordinates, body, gravity)
    n = len(coordinates)
    solved = solve_ivp(
        lambda _, y: np.concatenate([y[n:], right(y[:n], y[n:])]),
        (times[0], times[-1]), np.concatenate(start), "DOP853", times, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    assert solved.success
    return np.asarray(solved.y[:n].T)


def _right_hand_side(
    rotation: sp.Matrix,
    position: sp.Matrix,
    coordinates: Sequence[sp.Symbol],
    body: dict[str, Any],
    gravity: Sequence[float],
) -> Callable[[Array, Array], Array]:
    q = list(coordinates)
    rates = list(sp.symbols(f"rate:{len(q)}"))

    def rate(matrix: sp.Matrix) -> sp.Matrix:
        return sum((matrix.diff(x) * v for x, v in zip(q, rates, strict=True)), 0 * matrix)

    center = position + rotation * sp.Matrix(body["center_of_mass"])
    turning = rotation.T * rate(rotation)
    spin = sp.Matrix([turning[2, 1], turning[0, 2], turning[1, 0]])
    kinetic = body["mass"] * rate(center).dot(rate(center)) / 2
    kinetic += (spin.T * sp.Matrix(body["inertia"]) * spin)[0, 0] / 2
    potential = -body["mass"] * sp.Matrix(gravity).dot(center)
    momenta = sp.Matrix([kinetic.diff(v) for v in rates])
    forces = sp.Matrix([(kinetic - potential).diff(x) for x in q]) - rate(momenta)
    mass = momenta.jacobian(rates)
    numeric = sp.lambdify([q, rates], [mass, forces], "numpy", cse=True)

    def accelerations(at: Array, speeds: Array) -> Array:
        matrix, right = numeric(at, speeds)
        return np.asarray(np.linalg.solve(matrix, np.ravel(right)), dtype=np.float64)

    return accelerations
