"""Lagrange's equations of a small system from its energies, by SymPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import sympy as sp

Array = npt.NDArray[np.float64]


def accelerations(
    q: Sequence[Any], u: Sequence[Any], kinetic: Any, potential: Any, dissipation: Any, t: Any
) -> Callable[[float, Array, Array], Array]:
    """udot(t, q, u) of d/dt dT/du - dT/dq + dV/dq + dF/du = 0, F half the power that is lost."""
    coordinates, speeds = sp.Matrix(q), sp.Matrix(u)
    momenta = sp.Matrix([kinetic.diff(x) for x in u])
    mass = momenta.jacobian(speeds)
    lagrangian = kinetic - potential
    right = sp.Matrix([lagrangian.diff(x) for x in q]) - momenta.jacobian(coordinates) * speeds
    right -= sp.Matrix([dissipation.diff(x) for x in u])
    found = sp.lambdify((t, list(q), list(u)), [mass, right], cse=True)

    def udot(time: float, at: Array, rates: Array) -> Array:
        matrix, load = found(time, at, rates)
        return np.linalg.solve(matrix, np.ravel(load))

    return udot


def rotated_vector(angle: Any, x: Any, y: Any) -> Any:
    """A plane vector rotated counterclockwise by an angle."""
    return sp.Matrix([x * sp.cos(angle) - y * sp.sin(angle), x * sp.sin(angle) + y * sp.cos(angle)])


def rate(what: Any, q: Sequence[Any], u: Sequence[Any]) -> Any:
    """d/dt of an expression of coordinates."""
    return sum((what.diff(x) * v for x, v in zip(q, u, strict=True)), 0 * what)


def energy(mass: float, inertia: float, center: Any, angle: Any, q: Any, u: Any) -> Any:
    """Kinetic energy of a plane body."""
    v, w = rate(center, q, u), rate(angle, q, u)
    return mass * v.dot(v) / 2 + inertia * w**2 / 2
