"""Bearing in six directions: a bushing with non-symmetric stiffness and damping."""

import sympy as sp

from ..definition.element import Symbols
from . import force_bushing6
from .force_bushing6 import DAMPING_UNITS, STIFFNESS_UNITS, matrix_entries

_SIX = range(6)
#: Antisymmetric matrices are given by the part above the diagonal, row by row.
_ABOVE = tuple((i, j) for i in _SIX for j in _SIX if i < j)
#: Parameters of a bushing; they precede those of the bearing.
_SYMMETRIC = len(force_bushing6.Bushing.parameters)


def _antisymmetric(p: Symbols, first: int) -> sp.Matrix:
    places = {pair: first + k for k, pair in enumerate(_ABOVE)}

    def entry(i: int, j: int) -> sp.Expr:
        if i == j:
            return sp.Integer(0)
        return p[places[i, j]] if i < j else -p[places[j, i]]

    return sp.Matrix(6, 6, entry)


class Bearing(force_bushing6.Bushing):
    """Bushing with circulatory loads -N e and gyroscopic loads -G e' of antisymmetric N and G.

    The force N_x e and the moment N_r e act along the axes of F.  The load -N e counts as work.
    """

    name = "bearing6"
    title = "bearing with cross-coupled stiffness and damping"
    parameters = (
        *force_bushing6.Bushing.parameters,
        *matrix_entries("n", STIFFNESS_UNITS, "circulatory stiffness", _ABOVE),
        *matrix_entries("g", DAMPING_UNITS, "gyroscopic damping", _ABOVE),
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
        force, moment = super().wrench(x, v, rotation, w, p, effort, t)
        first = _SYMMETRIC
        deflection = self.deflection(x, rotation, p)
        lost = _antisymmetric(p, first) * deflection
        lost += _antisymmetric(p, first + len(_ABOVE)) * sp.Matrix([*v, *w])
        return force - lost[:3, :], moment - lost[3:, :]
