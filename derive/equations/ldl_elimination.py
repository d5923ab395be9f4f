"""Elimination of a hinge's free coordinates without back-substitution, and recovery.

With D = L diag(d) L^T the backward pass only needs L^-1; L^-T is applied when accelerations are
recovered, to one column instead of seven.  With the notation of `eliminate`:

    Y = L^-1 U^T,  Z = diag(d)^-1 Y,  y = L^-1 (tau - H^T e)
    S_Q = S - Y^T Z,  e_Q = e + Z^T y
    udot = L^-T (diag(d)^-1 y - Z a_Q)

Along a unit direction of H without rotor inertia J three identities are declared instead of
computed: the row and column of S_Q vanish, e_Q there is the effort tau, and as Z H = L^T the
component of a_Q along it passes unchanged to udot: udot = v - W a_Q with v = L^-T (...) over the
other directions only, W the unit columns of H transposed.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Factor, Quantity, Triangular
from .block_matrices import column, diagonal, symbol
from .hinge_elimination import REDUCED_E, REDUCED_S
from .riccati_sweep import (
    DELTA,
    PARENT_DELTA,
    SHIFT,
    SOURCES,
    E,
    R,
    S,
    free_speeds,
    outboard_deviation,
    replace_rows,
    unit_directions,
)


def _gains(nu: int) -> tuple[Quantity, Quantity, Quantity, Quantity]:
    return (
        Quantity(symbol("F", nu, nu), "", "D = L diag(d) L^T: L, and 1 / d on the diagonal"),
        Quantity(symbol("Z", nu, 6), "", "diag(d)^-1 L^-1 U^T, zero along unit directions"),
        Quantity(symbol("z", nu), "", "diag(d)^-1 L^-1 (tau - H^T e)"),
        Quantity(symbol("W", nu, 6), "", "unit columns of H, transposed"),
    )


def eliminate_factored(
    nu: int,
    subspace: sp.MatrixBase | None = None,
    inputs: tuple[Quantity, ...] = (),
    name: str | None = None,
) -> Derivation:
    """F, Z, z, W, S_Q, e_Q and the diagonal of D of a hinge.

    For the speeds of `subspace` or a given H with J.  With a given H no direction is known to
    be a unit direction: W = 0.
    """
    tau = Quantity(symbol("tau", nu), "N, N*m", "efforts on the free coordinates")
    h_given = Quantity(symbol("H", 6, nu), "", "motion subspace of the free coordinates")
    rotor = Quantity(symbol("J", nu), "kg*m2 or kg", "rotor inertia reflected to the speeds")
    pivots = Quantity(symbol("D_ii", nu), "kg*m2 or kg", "diagonal of D")
    factor, gain, offset, through = _gains(nu)
    h: sp.Basic = h_given.symbol if subspace is None else sp.ImmutableDenseMatrix(subspace)
    units = {} if subspace is None else unit_directions(subspace)
    push, pivot, full = symbol("U", 6, nu), symbol("D", nu, nu), symbol("Y", nu, 6)
    scaled, surplus = symbol("Z_full", nu, 6), symbol("y", nu)
    inertia = h.T * push
    if subspace is None:
        inertia = inertia + sp.ImmutableDenseMatrix(sp.diag(*column(rotor.symbol)))
    zeros = tuple((i, j) for i in range(6) for j in range(6) if i in units or j in units)
    right = tau.symbol - h.T * E.symbol
    e_full = symbol("e_full", 6)
    equations = (
        Equation("U = S H", push, S.symbol * h),
        Equation("D = H^T U + J", pivot, inertia),
        Equation("diagonal of D", pivots.symbol, diagonal(pivot)),
        Equation("L and 1 / d of D = L diag(d) L^T", factor.symbol, Factor(pivot)),
        Equation("Y = L^-1 U^T", full, Triangular(factor.symbol, push.T)),
        Equation("diag(d)^-1 Y", scaled, divide_rows(full, factor.symbol)),
        Equation("Z, without unit directions", gain.symbol, _without_columns(scaled, units)),
        Equation("unit directions", through.symbol, _unit_rows(nu, units)),
        Equation("y = L^-1 (tau - H^T e)", surplus, Triangular(factor.symbol, right)),
        Equation("diag(d)^-1 y", offset.symbol, divide_rows(surplus, factor.symbol)),
        Equation(
            "S_Q = S - Y^T Z",
            REDUCED_S.symbol,
            S.symbol - full.T * scaled,
            zeros=zeros,
            symmetric=True,
        ),
        Equation("e + Z^T y", e_full, E.symbol + scaled.T * surplus),
        Equation("e_Q", REDUCED_E.symbol, replace_rows(e_full, tau.symbol, units)),
    )
    extra_inputs = inputs if subspace is not None else (h_given, rotor)
    return Derivation(
        name or f"generic{nu}",
        f"elimination of a hinge with {free_speeds(nu)}",
        (*extra_inputs, S, E, tau),
        (factor, gain, offset, through, REDUCED_S, REDUCED_E, pivots),
        equations,
        sources=SOURCES,
    )


def recover_factored(nu: int) -> Derivation:
    """udot = v - W X delta_I, and the deviation X delta_I + H udot of the body.

    v = L^-T (z - Z X delta_I).  Along unit directions the deviation is v itself.
    """
    factor, gain, offset, through = _gains(nu)
    h = Quantity(symbol("H", 6, nu), "", "motion subspace of the free coordinates")
    rates = Quantity(symbol("udot", nu), "", "accelerations of the free coordinates")
    carried, along_units, v = symbol("delta_Q", 6), symbol("a_W", nu), symbol("v", nu)
    right_side = offset.symbol - gain.symbol * carried
    equations = (
        Equation("X delta_I", carried, outboard_deviation()),
        Equation("W X delta_I", along_units, through.symbol * carried),
        Equation("v", v, Triangular(factor.symbol, right_side, transposed=True)),
        Equation("udot = v - W X delta_I", rates.symbol, v - along_units),
        Equation(
            "deviation of the body", DELTA.symbol, (carried - h.symbol * along_units) + h.symbol * v
        ),
    )
    return Derivation(
        f"generic{nu}",
        f"accelerations recovered outboard of a factored hinge with {free_speeds(nu)}",
        (R, SHIFT, h, factor, gain, offset, through, PARENT_DELTA),
        (rates, DELTA),
        equations,
        sources=SOURCES,
    )


def divide_rows(full: sp.MatrixSymbol, factor: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """diag(d)^-1 times `full`."""
    return sp.ImmutableDenseMatrix(
        int(full.rows), int(full.cols), lambda i, j: full[i, j] * factor[i, i]
    )


def _without_columns(full: sp.MatrixSymbol, columns: dict[int, int]) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(
        int(full.rows), 6, lambda i, j: sp.Integer(0) if j in columns else full[i, j]
    )


def _unit_rows(nu: int, units: dict[int, int]) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix(nu, 6, lambda k, j: sp.Integer(units.get(j) == k))
