"""Elimination of a hinge's free coordinates, separate from the transport to the parent.

The sweep across a hinge is an elimination in the hinge's own axes followed by a transport.  Where
the transport is done in stages (axial screws), the elimination is a separate step:

    U = S H,  D = H^T U + J,  G = D^-1 U^T,  g = D^-1 (tau - H^T e)
    S_Q = S - U G,  e_Q = e + G^T (tau - H^T e)

Along a unit direction of H without rotor inertia J three identities are declared instead of
computed: the row and column of S_Q vanish, e_Q there is the effort tau, and the column of G there
is a unit vector (G H = 1).
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve
from .block_matrices import column, diagonal, symbol
from .riccati_sweep import SOURCES, E, S, free_speeds, gains, replace_rows, unit_directions

REDUCED_S = Quantity(symbol("S_Q", 6, 6), "", "S outboard of the hinge, hinge axes", symmetric=True)
REDUCED_E = Quantity(symbol("e_Q", 6), "N, N*m", "e outboard of the hinge, hinge axes")


def eliminate(
    nu: int,
    subspace: sp.MatrixBase | None = None,
    inputs: tuple[Quantity, ...] = (),
    name: str | None = None,
    rotor: sp.Expr | None = None,
) -> Derivation:
    """G, g, S_Q, e_Q and the diagonal of D of a hinge.

    For the speeds of `subspace`, of which one may have a `rotor`, or of a given H with J.
    """
    tau = Quantity(symbol("tau", nu), "N, N*m", "efforts on the free coordinates")
    h_given = Quantity(symbol("H", 6, nu), "", "motion subspace of the free coordinates")
    given_rotor = Quantity(symbol("J", nu), "kg*m2 or kg", "rotor inertia reflected to the speeds")
    gain, offset = gains(nu)
    pivots = Quantity(symbol("D_ii", nu), "kg*m2 or kg", "diagonal of D")
    h: sp.Basic = h_given.symbol if subspace is None else sp.ImmutableDenseMatrix(subspace)
    units = {} if subspace is None or rotor is not None else unit_directions(subspace)
    push, pivot, full = symbol("U", 6, nu), symbol("D", nu, nu), symbol("G_full", nu, 6)
    inertia = h.T * push
    if subspace is None:
        inertia = inertia + sp.ImmutableDenseMatrix(sp.diag(*column(given_rotor.symbol)))
    elif rotor is not None:
        inertia = inertia + sp.ImmutableDenseMatrix([rotor])
    zeros = tuple((i, j) for i in range(6) for j in range(6) if i in units or j in units)
    equations = (
        Equation("U = S H", push, S.symbol * h),
        Equation("D = H^T U + J", pivot, inertia),
        Equation("diagonal of D", pivots.symbol, diagonal(pivot)),
        Equation("D^-1 U^T", full, Solve(pivot, push.T, symmetric=True)),
        Equation("G, with G H = 1", gain.symbol, with_unit_columns(full, units)),
        Equation("surplus effort", symbol("surplus", nu), tau.symbol - h.T * E.symbol),
        Equation(
            "g = D^-1 (tau - H^T e)",
            offset.symbol,
            Solve(pivot, symbol("surplus", nu), symmetric=True),
        ),
        Equation(
            "S_Q = S - U G",
            REDUCED_S.symbol,
            S.symbol - push * gain.symbol,
            zeros=zeros,
            symmetric=True,
        ),
        Equation(
            "e + G^T (tau - H^T e)",
            symbol("e_full", 6),
            E.symbol + gain.symbol.T * symbol("surplus", nu),
        ),
        Equation("e_Q", REDUCED_E.symbol, replace_rows(symbol("e_full", 6), tau.symbol, units)),
    )
    extra_inputs = inputs if subspace is not None else (h_given, given_rotor)
    return Derivation(
        name or f"generic{nu}",
        f"elimination of a hinge with {free_speeds(nu)}",
        (*extra_inputs, S, E, tau),
        (gain, offset, REDUCED_S, REDUCED_E, pivots),
        equations,
        sources=SOURCES,
    )


def with_unit_columns(full: sp.MatrixSymbol, units: dict[int, int]) -> sp.ImmutableDenseMatrix:
    """G with unit vectors in the columns along unit directions."""
    return sp.ImmutableDenseMatrix(
        int(full.rows), 6, lambda i, j: sp.Integer(i == units[j]) if j in units else full[i, j]
    )
