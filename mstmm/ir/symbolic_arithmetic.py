"""Operations of the IR on numbers that carry formulas (`numbers.formula`).

Operations with branches (select, min, abs, comparisons) follow the values, so that the result is
the formula of the active branch.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from ..numerics.rotations import cos_sin
from ..numerics.symbolic_number import (
    Formula,
    apply_function,
    cos_sin_with_values,
    formula,
    square_root,
)
from .interpreter import Operations
from .operations import OPERATIONS, is_true
from .statements import Constant

#: Largest whole exponent that is multiplied out.
_MAX_EXPANDED_EXPONENT = 16


class FormulaArithmetic:
    """Arithmetic of `ir.replay.run` on Formulas.

    With `branches` the result keeps every branch, and is valid for all values.
    """

    def __init__(self, branches: bool = False) -> None:
        defaults = {op: partial(_apply_function, op) for op in OPERATIONS}
        self.operations: Operations = (
            defaults | _OPERATIONS | (_BRANCH_OPERATIONS if branches else {})
        )

    def number(self, value: Any) -> Formula:
        return formula(value)

    def constant(self, constant: Constant) -> Formula:
        return formula(constant.number)

    def true(self, value: Formula) -> bool:
        return is_true(value.value)


def _apply_function(op: str, *args: Formula) -> Formula:
    return apply_function(op, args, OPERATIONS[op].value(*(x.value for x in args)))


def _numerical_result(op: str, *args: Formula) -> Formula:
    """Numerical result of an operation, without a formula."""
    return formula(OPERATIONS[op].value(*(x.value for x in args)))


def _power(base: Formula, exponent: Formula) -> Formula:
    """Power, multiplied out for small whole exponents."""
    if (
        not exponent.is_constant
        or exponent.value % 1
        or abs(exponent.value) > _MAX_EXPANDED_EXPONENT
    ):
        return _apply_function("pow", base, exponent)
    product = formula(1.0)
    for _ in range(abs(int(exponent.value))):
        product = product * base
    product = _quotient(formula(1.0), product) if exponent.value < 0 else product
    return Formula(OPERATIONS["pow"].value(base.value, exponent.value), product.terms)


def _quotient(a: Formula, b: Formula) -> Formula:
    return a / b if b.value else _numerical_result("div", a, b)


def _square_root(x: Formula) -> Formula:
    return square_root(x) if x.value >= 0 else _numerical_result("sqrt", x)


def _select(condition: Formula, a: Formula, b: Formula) -> Formula:
    """Selection that keeps both branches unless they are equal or the condition is constant."""
    if condition.is_constant or a.terms == b.terms:
        return a if is_true(condition.value) else b
    return _apply_function("select", condition, a, b)


def _nonnegative_root(x: Formula) -> Formula:
    """Square root, wrapped in abs where its formula could become negative."""
    result = _square_root(x)
    is_nonnegative = result.is_constant or any(
        atom.op == "sqrt" for m in result.terms for atom, _ in m
    )
    return result if is_nonnegative else _apply_function("abs", result)


def _formula_cos_sin(angle: Formula) -> tuple[Formula, Formula]:
    return cos_sin_with_values(angle, *cos_sin(angle.value))


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": _quotient,
    "pow": _power,
    "sqrt": _square_root,
    "cos": lambda a: _formula_cos_sin(a)[0],
    "sin": lambda a: _formula_cos_sin(a)[1],
    "abs": abs,
    "min": lambda a, b: a if OPERATIONS["min"].value(a.value, b.value) == a.value else b,
    "max": lambda a, b: a if OPERATIONS["max"].value(a.value, b.value) == a.value else b,
    "select": lambda c, a, b: a if is_true(c.value) else b,
    **{
        op: partial(_numerical_result, op)
        for op in ("sign", "floor", "lt", "le", "eq", "and", "or", "not")
    },
}
_BRANCH_OPERATIONS: dict[str, Callable[..., Any]] = {
    "sqrt": _nonnegative_root,
    "select": _select,
    **{op: partial(_apply_function, op) for op in ("abs", "min", "max", "sign", "floor")},
    **{op: partial(_apply_function, op) for op in ("lt", "le", "eq", "and", "or", "not")},
}  # fmt: skip
