"""Further right-hand sides through a factored tree: M^-1 times columns.

S is carried to the root once, as for accelerations; of each elimination the factor of D and
G = D^-1 H^T S stay.  A column of efforts tau then travels alone, with no bias motion and no load
but its own:

    y = tau - H^T e,  e_Q = e + G^T y          tips to root
    udot = D^-1 y - G a_Q,  a = a_Q + H udot   root to tips
"""

from __future__ import annotations

import sympy as sp

from ..language.derivation import Derivation, Equation, Factor, Quantity, Triangular
from .algebra import column, symbol
from .factored import divided
from .sweep import (
    DELTA,
    PARENT_DELTA,
    PARENT_E,
    SHIFT,
    SOURCES,
    E,
    R,
    S,
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
    """F of a hinge; G comes with S, as for accelerations (`sweep.condense`)."""
    h, factored, _, _ = _hinge(nu)
    rotor = Quantity(symbol("J", nu), "kg*m2 or kg", "rotor inertia reflected to the speeds")
    pivot = symbol("D", nu, nu)
    rotors = sp.ImmutableDenseMatrix(sp.diag(*column(rotor.symbol)))
    equations = (
        Equation("D = H^T S H + J", pivot, h.symbol.T * (S.symbol * h.symbol) + rotors),
        Equation("L and 1 / d of D = L diag(d) L^T", factored.symbol, Factor(pivot)),
    )
    return Derivation(
        f"generic{nu}",
        f"factor of D of a hinge with {free_speeds(nu)}",
        (h, rotor, S),
        (factored,),
        equations if nu else (),
        sources=SOURCES,
    )


def push(nu: int) -> Derivation:
    """The load of one column carried to the parent."""
    h, _, gain, surplus = _hinge(nu)
    tau = Quantity(symbol("tau", nu), "N, N*m", "the column's efforts on the free coordinates")
    onward = symbol("e_Q", 6)
    equations: tuple[Equation, ...] = (Equation("e_Q = e", onward, E.symbol),)
    if nu:
        equations = (
            Equation("y = tau - H^T e", surplus.symbol, tau.symbol - h.symbol.T * E.symbol),
            Equation("e_Q = e + G^T y", onward, E.symbol + gain.symbol.T * surplus.symbol),
        )
    return Derivation(
        f"generic{nu}",
        f"load of a column carried across a hinge with {free_speeds(nu)}",
        (R, SHIFT, h, gain, E, tau),
        (surplus, PARENT_E),
        (*equations, Equation("X^T e_Q", PARENT_E.symbol, transport(onward))),
        sources=SOURCES,
    )


def answer(nu: int) -> Derivation:
    """udot = D^-1 y - G X delta_I and the body's own deviation X delta_I + H udot."""
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
                Triangular(factor.symbol, divided(below, factor.symbol), transposed=True),
            ),
            Equation("udot", rates.symbol, alone - gain.symbol * carried),
            Equation("deviation of the body", DELTA.symbol, carried + h.symbol * rates.symbol),
        ]
    else:
        equations.append(Equation("deviation of the body", DELTA.symbol, carried))
    return Derivation(
        f"generic{nu}",
        f"accelerations that answer a column, across a hinge with {free_speeds(nu)}",
        (R, SHIFT, h, factor, gain, surplus, PARENT_DELTA),
        (rates, DELTA),
        tuple(equations),
        sources=SOURCES,
    )
