"""Bushing: three forces and three moments from the relative motion of two ends."""

import sympy as sp

from ..definition.element import ForceElement, Param, Symbols
from ..definition.notation import rotation_vector

_SIX = range(6)
#: Symmetric matrices are given by the upper triangle, row by row.
_PAIRS = tuple((i, j) for i in _SIX for j in _SIX if i <= j)
#: Units between two translations, a translation and a rotation, two rotations.
STIFFNESS_UNITS = ("N/m", "N/rad", "N*m/rad")
DAMPING_UNITS = ("N*s/m", "N*s/rad", "N*m*s/rad")


def matrix_entries(
    letter: str, units: tuple[str, str, str], meaning: str, pairs: tuple[tuple[int, int], ...]
) -> tuple[Param, ...]:
    """Parameters for the given entries of a 6 x 6 matrix."""
    return tuple(
        Param(f"{letter}{i + 1}{j + 1}", units[(i > 2) + (j > 2)], meaning, default=0.0)
        for i, j in pairs
    )


def _symmetric(p: Symbols, first: int) -> sp.Matrix:
    places = {pair: first + k for k, pair in enumerate(_PAIRS)}
    return sp.Matrix(6, 6, lambda i, j: p[places[min(i, j), max(i, j)]])


class Bushing(ForceElement):
    """Potential V = e^T K e / 2 - e^T preload of the deflection e = [x; rotation vector].

    Dampers act on the rate of x and the relative angular velocity; the angle stays below 170
    degrees.
    """

    name = "bushing6"
    title = "bushing in six directions"
    parameters = (
        *matrix_entries("k", STIFFNESS_UNITS, "stiffness", _PAIRS),
        *matrix_entries("c", DAMPING_UNITS, "damping", _PAIRS),
        *(
            Param(f"preload{k + 1}", "N" if k < 3 else "N*m", "load on T at rest", default=0.0)
            for k in _SIX
        ),
    )

    def wrench(
        self,
        x: sp.Matrix,
        v: sp.Matrix,
        rotation: sp.Matrix,
        w: sp.Matrix,
        p: Symbols,
        effort: sp.Symbol,
        t: sp.Symbol,
    ) -> tuple[sp.Matrix, sp.Matrix]:
        lost = _symmetric(p, len(_PAIRS)) * sp.Matrix([*v, *w])
        return -lost[:3, :], -lost[3:, :]

    def deflection(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Matrix:
        return sp.Matrix([*x, *rotation_vector(rotation)])

    def potential(self, deflection: sp.Matrix, p: Symbols) -> sp.Expr:
        first = 2 * len(_PAIRS)
        preload = sp.Matrix(list(p)[first : first + 6])
        return deflection.dot(_symmetric(p, 0) * deflection / 2 - preload)

    def domain_by_rotation(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Basic:
        return 1 + rotation.trace() > sp.Rational(3, 100)
