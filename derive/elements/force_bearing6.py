"""Bearing in six directions: a bushing with non-symmetric stiffness and damping."""

import sympy as sp

from ..definition.element import ForceElement, Param, Symbols
from . import force_bushing6

_SIX = range(6)
#: Antisymmetric matrices are given by the part above the diagonal, row by row.
_ABOVE = tuple((i, j) for i in _SIX for j in _SIX if i < j)
#: Parameters of a bushing; they precede those of the bearing.
_SYMMETRIC = len(force_bushing6.Bushing.parameters)
_UNITS = (("N/m", "N/rad", "N*m/rad"), ("N*s/m", "N*s/rad", "N*m*s/rad"))


def _entries(letter: str, units: tuple[str, str, str], meaning: str) -> tuple[Param, ...]:
    return tuple(
        Param(f"{letter}{i + 1}{j + 1}", units[(i > 2) + (j > 2)], meaning, default=0.0)
        for i, j in _ABOVE
    )


def _antisymmetric(p: Symbols, first: int) -> sp.Matrix:
    places = {pair: first + k for k, pair in enumerate(_ABOVE)}

    def entry(i: int, j: int) -> sp.Expr:
        if i == j:
            return sp.Integer(0)
        return p[places[i, j]] if i < j else -p[places[j, i]]

    return sp.Matrix(6, 6, entry)


class Bearing(ForceElement):
    """Bushing with circulatory loads -N e and gyroscopic loads -G e' of antisymmetric N and G.

    The force N_x e and the moment N_r e act along the axes of F.  The load -N e counts as work.
    """

    name = "bearing6"
    title = "bearing with cross-coupled stiffness and damping"
    parameters = (
        *force_bushing6.Bushing.parameters,
        *_entries("n", _UNITS[0], "circulatory stiffness"),
        *_entries("g", _UNITS[1], "gyroscopic damping"),
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
        symmetric = force_bushing6.Bushing().wrench(x, v, rotation, w, p, effort, t)
        first = _SYMMETRIC
        deflection = self.deflection(x, rotation, p)
        lost = _antisymmetric(p, first) * deflection
        lost += _antisymmetric(p, first + len(_ABOVE)) * sp.Matrix([*v, *w])
        return symmetric[0] - lost[:3, :], symmetric[1] - lost[3:, :]

    def deflection(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Matrix:
        return force_bushing6.Bushing().deflection(x, rotation, p)

    def potential(self, deflection: sp.Matrix, p: Symbols) -> sp.Expr:
        return force_bushing6.Bushing().potential(deflection, p)

    def domain_by_rotation(self, x: sp.Matrix, rotation: sp.Matrix, p: Symbols) -> sp.Basic:
        return force_bushing6.Bushing().domain_by_rotation(x, rotation, p)
