"""Elimination of a hinge's free coordinates, apart from the transport to the parent."""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Factor, Quantity, Solve, Triangular
from ..definition.notation import column, diagonal, symbol
from .riccati_sweep import (
    DELTA,
    FLOOR,
    PARENT_DELTA,
    PARENT_E,
    PARENT_S,
    SHIFT,
    SOURCES,
    E,
    R,
    S,
    congruence,
    free_speeds,
    gains,
    outboard_deviation,
    replace_rows,
    transport,
    unit_directions,
)

# --- elimination with back-substitution -----------------------------------------------------------
# The sweep across a hinge is an elimination in the hinge's own axes followed by a transport.  Where
# the transport is done in stages (axial screws), the elimination is a separate step:
#
#     U = S H,  D = H^T U + J,  G = D^-1 U^T,  g = D^-1 (tau - H^T e)
#     S_Q = S - U G,  e_Q = e + G^T (tau - H^T e)
#
# Along a unit direction of H without rotor inertia J three identities are declared instead of
# computed: the row and column of S_Q vanish, e_Q there is the effort tau, and the column of G there
# is a unit vector (G H = 1).

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


# --- elimination without back-substitution --------------------------------------------------------


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


# --- several right-hand sides ---------------------------------------------------------------------
# S is carried to the root once, as for accelerations; each elimination keeps the factor of D and G
# = D^-1 H^T S.  Other derivatives of the rows by accelerations, such as those of laws within a
# step, are added to D.  A column of efforts tau is then carried without bias motion or other
# loads:
#
#     y = tau - H^T e,  e_Q = e + G^T y          tips to root
#     udot = D^-1 y - G a_Q,  a = a_Q + H udot   root to tips


def _hinge(nu: int) -> tuple[Quantity, Quantity, Quantity, Quantity]:
    """H, F, G and y of a hinge."""
    return (
        Quantity(symbol("H", 6, nu), "", "motion subspace of the free coordinates"),
        Quantity(symbol("F", nu, nu), "", "D = L diag(d) L^T: L, and 1 / d on the diagonal"),
        Quantity(symbol("G", nu, 6), "", "D^-1 H^T S"),
        Quantity(symbol("y", nu), "N, N*m", "tau - H^T e"),
    )


def factor(nu: int) -> Derivation:
    """F and G of a hinge, and S carried to the parent.

    Only the symmetric part of W (derivatives of the rows besides inertia) is added to D.
    """
    h, factored, gain, _ = _hinge(nu)
    rotor = Quantity(symbol("J", nu), "kg*m2 or kg", "rotor inertia reflected to the speeds")
    laws = Quantity(symbol("W", nu, nu), "", "change of the efforts of laws, one row per speed")
    push, pivot, below = symbol("U", 6, nu), symbol("D", nu, nu), symbol("Y", nu, 6)
    scaled, reduced = symbol("Z", nu, 6), symbol("S_Q", 6, 6)
    equations: tuple[Equation, ...] = (Equation("S_Q = S", reduced, S.symbol),)
    if nu:
        rotors = sp.ImmutableDenseMatrix(sp.diag(*column(rotor.symbol)))
        equations = (
            Equation("U = S H", push, S.symbol * h.symbol),
            Equation(
                "D = H^T U + J - (W + W^T) / 2",
                pivot,
                h.symbol.T * push + rotors - _symmetric(laws.symbol),
            ),
            Equation("L and 1 / d of D = L diag(d) L^T", factored.symbol, Factor(pivot)),
            Equation("Y = L^-1 U^T", below, Triangular(factored.symbol, push.T)),
            Equation("diag(d)^-1 Y", scaled, divide_rows(below, factored.symbol)),
            Equation(
                "G = L^-T diag(d)^-1 Y",
                gain.symbol,
                Triangular(factored.symbol, scaled, transposed=True),
            ),
            Equation(
                "S_Q = S - Y^T diag(d)^-1 Y", reduced, S.symbol - below.T * scaled, symmetric=True
            ),
        )
    steps, transported = congruence("S_Q")
    return Derivation(
        f"generic{nu}",
        f"S carried across a hinge with {free_speeds(nu)}, and the factor of D",
        (R, SHIFT, h, rotor, laws, FLOOR, S),
        (factored, gain, PARENT_S),
        (*equations, *steps, Equation("X^T S_Q X", PARENT_S.symbol, transported)),
        sources=SOURCES,
    )


def _symmetric(matrix: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """(A + A^T) / 2."""
    size = int(matrix.rows)
    return sp.ImmutableDenseMatrix(
        size, size,
        lambda i, j: matrix[i, i] if i == j else sp.Rational(1, 2) * (matrix[i, j] + matrix[j, i]),
    )  # fmt: skip


def column_load(nu: int) -> Derivation:
    """Load of one column carried to the parent."""
    h, _, gain, surplus = _hinge(nu)
    tau = Quantity(
        symbol("tau", nu), "N, N*m", "efforts of the right-hand side on the free coordinates"
    )
    onward = symbol("e_Q", 6)
    equations: tuple[Equation, ...] = (Equation("e_Q = e", onward, E.symbol),)
    if nu:
        equations = (
            Equation("y = tau - H^T e", surplus.symbol, tau.symbol - h.symbol.T * E.symbol),
            Equation("e_Q = e + G^T y", onward, E.symbol + gain.symbol.T * surplus.symbol),
        )
    return Derivation(
        f"generic{nu}",
        f"load of a right-hand side carried across a hinge with {free_speeds(nu)}",
        (R, SHIFT, h, gain, E, tau),
        (surplus, PARENT_E),
        (*equations, Equation("X^T e_Q", PARENT_E.symbol, transport(onward))),
        sources=SOURCES,
    )


def ground_column_load(nu: int) -> Derivation:
    """y of one column at a hinge on the ground."""
    h, _, _, surplus = _hinge(nu)
    tau = Quantity(
        symbol("tau", nu), "N, N*m", "efforts of the right-hand side on the free coordinates"
    )
    value = tau.symbol - h.symbol.T * E.symbol
    return Derivation(
        f"generic{nu}",
        f"load of a right-hand side along a hinge on the ground with {free_speeds(nu)}",
        (h, E, tau), (surplus,),
        (Equation("y = tau - H^T e", surplus.symbol, value),), sources=SOURCES,
    )  # fmt: skip


def column_acceleration(nu: int) -> Derivation:
    """udot = D^-1 y - G X delta_I and the deviation X delta_I + H udot of the body."""
    h, factor, gain, surplus = _hinge(nu)
    rates = Quantity(symbol("udot", nu), "", "accelerations of the free coordinates")
    carried, below, alone = symbol("delta_Q", 6), symbol("z", nu), symbol("v", nu)
    equations: list[Equation] = [Equation("X delta_I", carried, outboard_deviation())]
    if nu:
        equations += [
            Equation("L^-1 y", below, Triangular(factor.symbol, surplus.symbol)),
            Equation(
                "D^-1 y",
                alone,
                Triangular(factor.symbol, divide_rows(below, factor.symbol), transposed=True),
            ),
            Equation("udot", rates.symbol, alone - gain.symbol * carried),
            Equation("deviation of the body", DELTA.symbol, carried + h.symbol * rates.symbol),
        ]
    else:
        equations.append(Equation("deviation of the body", DELTA.symbol, carried))
    return Derivation(
        f"generic{nu}",
        f"accelerations due to a right-hand side, across a hinge with {free_speeds(nu)}",
        (R, SHIFT, h, factor, gain, surplus, PARENT_DELTA),
        (rates, DELTA),
        tuple(equations),
        sources=SOURCES,
    )
