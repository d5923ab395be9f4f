"""Constrained directions of a hinge: the complement of its motion subspace.

Of the six directions between the two sides of a hinge, H spans the free ones.  The rows of

    W = [H^+; N^T],  H^+ = (H^T H)^-1 H^T,  N^T H = 0,  N^T N = 1

applied to a relative motion give the hinge's own speeds, then the constrained components.  N is
formed by reflections that map the columns of H to coordinate directions one by one (Householder, J.
ACM 5 (1958) 339-342), so that axes along coordinates leave coordinate directions.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve
from .block_matrices import symbol

SOURCES = ("Householder, J. ACM 5 (1958) 339-342 (reflections)",)

#: Rows of W; each is a load along a free or a constrained direction.
DIRECTIONS = Quantity(symbol("W", 6, 6), "", "rows: H^+, then the constrained directions")


def complement(nu: int) -> Derivation:
    """W of a hinge with nu speeds."""
    h = Quantity(symbol("H", 6, nu), "", "motion subspace")
    equations: list[Equation] = []
    reflected: sp.Basic = h.symbol
    mirrors: list[tuple[sp.MatrixSymbol, sp.MatrixSymbol]] = []
    for k in range(nu):
        mirror, equations_of_mirror = _reflection(k, reflected)
        equations += equations_of_mirror
        mirrors.append(mirror)
        if k + 1 < nu:
            next_matrix = symbol(f"H_{k + 1}", 6, nu)
            equations.append(
                Equation(
                    f"H, reflected {k + 1} times", next_matrix, _apply_reflection(mirror, reflected)
                )
            )
            reflected = next_matrix
    constrained: sp.Basic = sp.ImmutableDenseMatrix(6, 6 - nu, lambda i, j: sp.Integer(i == j + nu))
    for k in reversed(range(nu)):
        next_matrix = symbol(f"N_{k + 1}", 6, 6 - nu)
        if nu < 6:
            equations.append(
                Equation(
                    f"N after reflection {k + 1}",
                    next_matrix,
                    _apply_reflection(mirrors[k], constrained),
                )
            )
            constrained = next_matrix
    rows: list[list[sp.Expr]] = []
    if nu:
        gram, inverse = symbol("HH", nu, nu), symbol("H_inv", nu, 6)
        equations += [
            Equation("H^T H", gram, h.symbol.T * h.symbol),
            Equation("H^+", inverse, Solve(gram, h.symbol.T, symmetric=True)),
        ]
        rows += [[inverse[k, i] for i in range(6)] for k in range(nu)]
    rows += [[constrained[i, j] for i in range(6)] for j in range(6 - nu)]
    equations.append(Equation("W", DIRECTIONS.symbol, sp.ImmutableDenseMatrix(rows)))
    return Derivation(
        f"generic{nu}",
        f"free and constrained directions of a hinge with {nu} speeds",
        (h,),
        (DIRECTIONS,),
        tuple(equations),
        sources=SOURCES,
    )


def _reflection(
    k: int, matrix: sp.Basic
) -> tuple[tuple[sp.MatrixSymbol, sp.MatrixSymbol], list[Equation]]:
    """v and b of the reflection 1 - b v v^T that maps column k to direction k."""
    size, v, b = symbol(f"size_{k + 1}", 1), symbol(f"v_{k + 1}", 6), symbol(f"b_{k + 1}", 1)
    length, first = size[0, 0], matrix[k, k]
    first_entry = first + sp.Piecewise((-length, first < 0), (length, True))
    entries = [*[sp.Integer(0)] * k, first_entry, *(matrix[i, k] for i in range(k + 1, 6))]
    share = length * (length + sp.Abs(first))
    return (v, b), [
        Equation(
            f"length of column {k + 1}", size,
            sp.ImmutableDenseMatrix([sp.sqrt(sum(matrix[i, k] ** 2 for i in range(k, 6)))]),
        ),
        Equation(f"reflection vector {k + 1}", v, sp.ImmutableDenseMatrix(entries)),
        Equation(
            f"2 / v^T v of reflection vector {k + 1}", b,
            sp.ImmutableDenseMatrix([sp.Piecewise((1 / share, share > 0), (0, True))]),
        ),
    ]  # fmt: skip


def _apply_reflection(
    mirror: tuple[sp.MatrixSymbol, sp.MatrixSymbol], matrix: sp.Basic
) -> sp.Basic:
    v, b = mirror
    rows, columns = (int(extent) for extent in matrix.shape)
    projections = [sum(v[i, 0] * matrix[i, j] for i in range(rows)) for j in range(columns)]
    return sp.ImmutableDenseMatrix(
        rows, columns, lambda i, j: matrix[i, j] - b[0, 0] * v[i, 0] * projections[j]
    )
