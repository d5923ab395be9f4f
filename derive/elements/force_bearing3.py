"""Bearing without moments, with symmetric and cross-coupled matrices."""

import sympy as sp

from ..definition.element import ForceElement, Param, Symbols

_THREE = range(3)
#: Symmetric matrices are given by the upper triangle, antisymmetric ones by the part above the
#: diagonal.
_PAIRS = tuple((i, j) for i in _THREE for j in _THREE if i <= j)
_ABOVE = tuple((i, j) for i in _THREE for j in _THREE if i < j)


def _entries(
    letter: str, unit: str, meaning: str, pairs: tuple[tuple[int, int], ...]
) -> list[Param]:
    return [Param(f"{letter}{i + 1}{j + 1}", unit, meaning, default=0.0) for i, j in pairs]


def _matrix(p: Symbols, symmetric: int, antisymmetric: int | None) -> sp.Matrix:
    upper = {pair: p[symmetric + k] for k, pair in enumerate(_PAIRS)}
    zero = sp.Integer(0)
    above = {
        pair: zero if antisymmetric is None else p[antisymmetric + k]
        for k, pair in enumerate(_ABOVE)
    }

    def entry(i: int, j: int) -> sp.Expr:
        both = upper[min(i, j), max(i, j)]
        return both + above[i, j] if i < j else both - above[j, i] if i > j else both

    return sp.Matrix(3, 3, entry)


class Bearing(ForceElement):
    """Potential V = x^T K x / 2 - x^T preload and dampers -C v.

    Antisymmetric N and G add the loads -N x and -G v, which count as work.
    """

    name = "bearing3"
    title = "bearing without moments, cross-coupled"
    parameters = (
        *_entries("k", "N/m", "stiffness", _PAIRS),
        *_entries("c", "N*s/m", "damping", _PAIRS),
        *(Param(f"preload{k + 1}", "N", "load on T at rest", default=0.0) for k in _THREE),
        *_entries("n", "N/m", "circulatory stiffness", _ABOVE),
        *_entries("g", "N*s/m", "gyroscopic damping", _ABOVE),
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
        force = sp.Matrix(list(p)[12:15]) - _matrix(p, 0, 15) * x - _matrix(p, 6, 18) * v
        return force, sp.zeros(3, 1)

    def potential(self, x: sp.Matrix, p: Symbols) -> sp.Expr:
        return x.dot(_matrix(p, 0, None) * x / 2 - sp.Matrix(list(p)[12:15]))
