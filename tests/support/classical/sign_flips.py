"""Mutations of premises: turn the sign of one term, to see that a check notices."""

from __future__ import annotations

import sympy as sp

from mstmm.derive.definition.derivation import Equation
from mstmm.derive.definition.notation import residual

Flip = tuple[int, str, int]


def terms(expression: sp.Basic) -> tuple[sp.Basic, ...]:
    """Summands of a matrix expression."""
    return expression.args if isinstance(expression, sp.MatAdd) else (expression,)


def flips(premises: tuple[Equation, ...]) -> list[Flip]:
    """Every term of every premise: (premise, side, term)."""
    return [
        (i, side, k)
        for i, premise in enumerate(premises)
        for side in ("left", "right")
        for k in range(len(terms(getattr(premise, side))))
    ]


def flip_sign(premises: tuple[Equation, ...], flip: Flip) -> tuple[Equation, ...]:
    """The premises with the sign of one term changed."""
    i, side, k = flip
    premise = premises[i]
    sides = {"left": premise.left, "right": premise.right}
    sides[side] = sides[side] - 2 * terms(sides[side])[k]
    changed = Equation(premise.name, sides["left"], sides["right"])
    assert residual(changed) != residual(premise)
    return (*premises[:i], changed, *premises[i + 1 :])
