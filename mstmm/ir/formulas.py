"""Operations of the IR on numbers that carry formulas (`numbers.formula`).

Operations with branches (select, min, abs, comparisons) follow the values, so that the result is
the formula of the active branch.
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

#: Largest whole exponent that is multiplied out.
_WHOLE = 16


class FormulaArithmetic:
    """Arithmetic of `ir.replay.run` on Formulas.

    With `branches` the result keeps every branch, and is valid for all values.
    """

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
    """Numerical result of an operation, without a formula."""
    return formula(OPERATIONS[op].value(*(x.value for x in args)))


def _power(base: Formula, exponent: Formula) -> Formula:
    """Power, multiplied out for small whole exponents."""
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
    """Selection that keeps both branches unless they are equal or the condition is constant."""
    if condition.fixed or a.terms == b.terms:
        return a if true(condition.value) else b
    return _function("select", condition, a, b)


def _positive_root(x: Formula) -> Formula:
    """Square root, wrapped in abs where its formula could become negative."""
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
