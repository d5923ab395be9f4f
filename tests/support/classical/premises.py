"""Premises evaluated on numbers, and linearised by differences: nothing of what was derived."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce
from typing import Any

import mpmath
import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement

from mstmm.derive.definition.derivation import Derivation, Equation
from mstmm.derive.definition.notation import Perp, Tilde

DIGITS = 80
#: Step of the differences; their error is its square.
STEP = mpmath.mpf(10) ** -25

Values = Mapping[str, mpmath.matrix]
#: First parts of the names of a state's blocks.
STATE_BLOCKS = ("r", "theta", "psi", "m", "q", "eta")


class Premises:
    """The premises of a derivation, as functions of named arrays.

    A premise whose left side is a symbol that is neither given nor a block of a state assigns it;
    every other one is a condition, of which `residuals` gives left minus right.
    """

    def __init__(self, derivation: Derivation) -> None:
        given = {q.name for q in derivation.inputs}
        self.steps = [(e, _assigns(e, given)) for e in derivation.premises]

    def residuals(self, values: Values) -> dict[str, mpmath.matrix]:
        """Condition's name -> left minus right."""
        known, found = dict(values), {}
        for equation, target in self.steps:
            value = matrix(equation.right, known)
            if target is not None:
                known[target] = value
            else:
                found[equation.name] = matrix(equation.left, known) - value
        return found

    def linearised_residuals(self, start: Values, step: Values) -> dict[str, mpmath.matrix]:
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


def matrix(e: sp.Basic, known: Values) -> mpmath.matrix:
    """A matrix expression of named arrays."""
    if isinstance(e, sp.MatrixSymbol):
        return known[str(e.name)]
    if isinstance(e, sp.MatrixBase):
        return mpmath.matrix([[scalar(x, known) for x in e.row(i)] for i in range(e.rows)])
    if isinstance(e, sp.ZeroMatrix):
        return mpmath.zeros(int(e.rows), int(e.cols))
    for kind, rule in _RULES.items():
        if isinstance(e, kind):
            parts: tuple[sp.Basic, ...] = e.args  # type: ignore[attr-defined]
            return rule([_numeric_value(part, known) for part in parts])
    if isinstance(e, sp.BlockMatrix):
        stacked = [matrix(e.blocks[k, 0], known) for k in range(e.blocks.rows)]
        return mpmath.matrix([row for block in stacked for row in block.tolist()])
    raise NotImplementedError(f"no value of {type(e).__name__}")


def _numeric_value(e: sp.Basic, known: Values) -> Any:
    return matrix(e, known) if getattr(e, "is_Matrix", False) else scalar(e, known)


def _tilde(a: mpmath.matrix) -> mpmath.matrix:
    return mpmath.matrix([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


_RULES: dict[type, Callable[[list[Any]], mpmath.matrix]] = {
    sp.MatAdd: lambda parts: reduce(lambda a, b: a + b, parts),
    sp.MatMul: lambda parts: reduce(lambda a, b: a * b, parts),
    sp.Transpose: lambda parts: parts[0].T,
    Tilde: lambda parts: _tilde(parts[0]),
    Perp: lambda parts: mpmath.matrix([-parts[0][1], parts[0][0]]),
    sp.MatPow: lambda parts: parts[0] ** int(parts[1]),
}


def scalar(e: sp.Basic, known: Values) -> Any:
    """A scalar expression of entries of named arrays."""
    if isinstance(e, MatrixElement):
        return known[str(e.parent.name)][int(e.i), int(e.j)]
    if isinstance(e, sp.Rational):
        return mpmath.mpf(int(e.p)) / int(e.q)
    return _FUNCTIONS[type(e)](*(scalar(part, known) for part in e.args))


_FUNCTIONS: dict[type, Callable[..., Any]] = {
    sp.Add: lambda *a: mpmath.fsum(a),
    sp.Mul: lambda *a: mpmath.fprod(a),
    sp.Pow: mpmath.power,
    sp.cos: mpmath.cos,
    sp.sin: mpmath.sin,
}
