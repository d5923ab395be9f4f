"""Premises evaluated on numbers, and linearised by differences: nothing of what was derived."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import mpmath
import sympy as sp

from mstmm.derive.derivation import Derivation, Equation
from mstmm.derive.notation import Matrix, explicit, matrix_symbols

DIGITS = 80
#: Step of the differences; their error is its square.
STEP = mpmath.mpf(10) ** -25

Values = Mapping[str, mpmath.matrix]


class Premises:
    """The premises of a derivation, as functions of named arrays.

    A premise whose left side is a symbol that is neither given nor a block of a state assigns it;
    every other one is a condition, of which `residuals` gives left minus right.
    """

    def __init__(self, derivation: Derivation) -> None:
        given = {q.name for q in derivation.inputs}
        self.steps = [_compiled(e, _assigns(e, given)) for e in derivation.premises]

    def residuals(self, values: Values) -> dict[str, mpmath.matrix]:
        """Condition's name -> left minus right."""
        known, found = dict(values), {}
        for name, target, arguments, function in self.steps:
            flat = [known[symbol][place] for symbol, place in arguments]
            result = mpmath.matrix(function(*flat))
            if target is not None:
                known[target] = result
            else:
                found[name] = result
        return found

    def linearised(self, start: Values, step: Values) -> dict[str, mpmath.matrix]:
        """Residuals at `start` plus their differential along `step` (arrays of the states)."""
        with mpmath.workdps(DIGITS):
            here = self.residuals(start)
            sides = [
                self.residuals(
                    dict(start) | {k: start[k] + sign * STEP * v for k, v in step.items()}
                )
                for sign in (1, -1)
            ]
            return {k: here[k] + (sides[0][k] - sides[1][k]) / (2 * STEP) for k in here}


def _assigns(equation: Equation, given: set[str]) -> str | None:
    left = equation.left
    if not isinstance(left, sp.MatrixSymbol):
        return None
    name = str(left.name)
    ends = name.endswith(("_O", "_I", "_N")) and name.rsplit("_", 1)[0] in STATE_BLOCKS
    return None if ends or name in given else name


#: First parts of the names of a state's blocks.
STATE_BLOCKS = ("r", "theta", "psi", "m", "q", "eta")

Step = tuple[str, str | None, list[tuple[str, tuple[int, int]]], Any]


def _compiled(equation: Equation, target: str | None) -> Step:
    value = explicit(equation.right)
    if target is None:
        value = Matrix(explicit(equation.left) - value)
    symbols = sorted(matrix_symbols(value), key=lambda s: str(s.name))
    entries = [entry for symbol in symbols for entry in symbol.as_explicit()]
    names = [sp.Dummy(f"x{k}") for k in range(len(entries))]
    plain = value.xreplace(dict(zip(entries, names, strict=True)))
    arguments = [
        (str(s.name), (i, j)) for s in symbols for i in range(s.rows) for j in range(s.cols)
    ]
    return equation.name, target, arguments, sp.lambdify(names, plain.tolist(), "mpmath")


@cache
def premises_of(name: str) -> Premises:
    """Premises of a generated flexible classical matrix."""
    from mstmm.derive.classical import CLASSICAL

    return Premises(CLASSICAL[name]())
