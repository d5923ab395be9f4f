"""Several right-hand sides with one factorisation of the tree: M^-1 times columns.

S is carried to the root once, as for accelerations; each elimination keeps the factor of D and G =
D^-1 H^T S.  Other derivatives of the rows by accelerations, such as those of laws within a step,
are added to D.  A column of efforts tau is then carried without bias motion or other loads:

    y = tau - H^T e,  e_Q = e + G^T y          tips to root
    udot = D^-1 y - G a_Q,  a = a_Q + H udot   root to tips
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Factor, Quantity, Triangular
from .block_matrices import column, symbol
from .ldl_elimination import divide_rows
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
    outboard_deviation,
    transport,
)


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
