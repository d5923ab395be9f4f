"""The operations of the IR on numbers that carry formulas (`numbers.formula`).

Where an operation takes branches (select, min, abs, comparisons) the values decide, so that what
comes out is the formula of the branch that is taken.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from ..numbers.formula import Formula, formula, function, root, turn
from ..numbers.rotations import cos_sin
from .operations import OPERATIONS, true
from .replay import Operations
from .statements import Constant

#: Powers that are multiplied out.
_WHOLE = 16


class FormulaArithmetic:
    """Arithmetic of `ir.replay.run` on Formulas; with `branches` every branch stays in what comes
    out, and holds for all values."""

    def __init__(self, branches: bool = False) -> None:
        every = {op: partial(_function, op) for op in OPERATIONS}
        self.operations: Operations = every | _OPERATIONS | (_BRANCHES if branches else {})

    def number(self, value: Any) -> Formula:
        return formula(value)

    def constant(self, constant: Constant) -> Formula:
        return formula(constant.number)

    def true(self, value: Formula) -> bool:
        return true(value.value)


def _function(op: str, *args: Formula) -> Formula:
    return function(op, args, OPERATIONS[op].value(*(x.value for x in args)))


def _decided(op: str, *args: Formula) -> Formula:
    """0, 1 or another number that the values alone decide, as of branches that are not taken."""
    return formula(OPERATIONS[op].value(*(x.value for x in args)))


def _power(base: Formula, exponent: Formula) -> Formula:
    """Whole powers multiplied out."""
    if not exponent.fixed or exponent.value % 1 or abs(exponent.value) > _WHOLE:
        return _function("pow", base, exponent)
    found = formula(1.0)
    for _ in range(abs(int(exponent.value))):
        found = found * base
    found = _quotient(formula(1.0), found) if exponent.value < 0 else found
    return Formula(OPERATIONS["pow"].value(base.value, exponent.value), found.terms)


def _quotient(a: Formula, b: Formula) -> Formula:
    return a / b if b.value else _decided("div", a, b)


def _root(x: Formula) -> Formula:
    return root(x) if x.value >= 0 else _decided("sqrt", x)


def _choice(condition: Formula, a: Formula, b: Formula) -> Formula:
    """a where the condition holds, else b."""
    if condition.fixed or a.terms == b.terms:
        return a if true(condition.value) else b
    return _function("select", condition, a, b)


def _positive_root(x: Formula) -> Formula:
    """The root, which is negative nowhere."""
    found = _root(x)
    plain = found.fixed or any(atom.op == "sqrt" for m in found.terms for atom, _ in m)
    return found if plain else _function("abs", found)


def _turn(angle: Formula) -> tuple[Formula, Formula]:
    return turn(angle, *cos_sin(angle.value))


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": _quotient,
    "pow": _power,
    "sqrt": _root,
    "cos": lambda a: _turn(a)[0],
    "sin": lambda a: _turn(a)[1],
    "abs": abs,
    "min": lambda a, b: a if OPERATIONS["min"].value(a.value, b.value) == a.value else b,
    "max": lambda a, b: a if OPERATIONS["max"].value(a.value, b.value) == a.value else b,
    "select": lambda c, a, b: a if true(c.value) else b,
    **{op: partial(_decided, op) for op in ("sign", "floor", "lt", "le", "eq", "and", "or", "not")},
}  # fmt: skip
_BRANCHES: dict[str, Callable[..., Any]] = {
    "sqrt": _positive_root,
    "select": _choice,
    **{op: partial(_function, op) for op in ("abs", "min", "max", "sign", "floor")},
    **{op: partial(_function, op) for op in ("lt", "le", "eq", "and", "or", "not")},
}  # fmt: skip
