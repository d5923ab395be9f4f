"""Dimensions of SymPy expressions, to check the units of a definition."""

from __future__ import annotations

import re
from collections.abc import Mapping

import sympy as sp

from mstmm.errors import ElementError

#: Exponents of m, kg, s; angles count as numbers.
Dimension = tuple[sp.Rational, sp.Rational, sp.Rational]

_PURE_NUMBER = (sp.Integer(0),) * 3
_UNITS: dict[str, tuple[int, int, int]] = {
    "": (0, 0, 0), "1": (0, 0, 0), "rad": (0, 0, 0), "turn": (0, 0, 0),
    "m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "Hz": (0, 0, -1),
    "N": (1, 1, -2), "J": (2, 1, -2), "W": (2, 1, -3), "Pa": (-1, 1, -2),
}  # fmt: skip
_FACTOR_PATTERN = re.compile(r"([A-Za-z]+|1)\s*(?:\^|\*\*)?\s*(-?\d+)?")


def dimension(unit: str) -> Dimension:
    """Dimension of a unit such as "N*m/rad", "kg*m2", "m/s^2".  Raises ElementError."""
    total = list(_PURE_NUMBER)
    above = True
    for part in re.split(r"([*/ ])", unit.replace("·", "*").strip()):
        if part in ("*", " ", ""):
            continue
        if part == "/":
            above = False
            continue
        match = _FACTOR_PATTERN.fullmatch(part)
        if match is None or match[1] not in _UNITS:
            raise ElementError(
                f"unit {unit!r}: unknown unit {part!r}; use m, kg, s, rad, N, J, W, Pa, Hz"
            )
        power = int(match[2] or 1) * (1 if above else -1)
        total = [t + power * e for t, e in zip(total, _UNITS[match[1]], strict=True)]
    return (total[0], total[1], total[2])


def dimension_text(dimensions: Dimension) -> str:
    """Dimension as a product of SI units."""
    parts = [
        name if power == 1 else f"{name}^{power}"
        for name, power in zip(("m", "kg", "s"), dimensions, strict=True)
        if power != 0
    ]
    return "*".join(parts) or "a pure number"


class UnitMismatch(Exception):
    """A sum or function whose operands have incompatible dimensions; the message names them."""


def dimension_of(expression: sp.Expr, known: Mapping[sp.Basic, Dimension]) -> Dimension | None:
    """Dimension of an expression; None for zero.  Raises UnitMismatch."""
    if expression == 0:
        return None
    if expression.is_number:
        return _PURE_NUMBER
    if expression in known:
        return known[expression]
    if isinstance(expression, sp.Add):
        return _common_dimension(expression.args, known, f"the sum {expression}")
    if isinstance(expression, (sp.Min, sp.Max)):
        return _common_dimension(expression.args, known, str(expression))
    if isinstance(expression, sp.Mul):
        return _product_dimension(expression, known)
    if isinstance(expression, sp.Pow):
        return _power_dimension(expression, known)
    if isinstance(expression, sp.Abs):
        return dimension_of(expression.args[0], known)
    if isinstance(expression, sp.Piecewise):
        return _common_dimension([value for value, _ in expression.args], known, str(expression))
    if isinstance(expression, sp.sign):
        dimension_of(expression.args[0], known)
        return _PURE_NUMBER
    if isinstance(expression, sp.atan2):
        _common_dimension(expression.args, known, str(expression))
        return _PURE_NUMBER
    for argument in expression.args:
        argument_dimension = dimension_of(argument, known)
        if argument_dimension not in (None, _PURE_NUMBER):
            raise UnitMismatch(
                f"{expression.func}({argument}) expects a pure number, found "
                f"{dimension_text(argument_dimension)}"
            )
    return _PURE_NUMBER


def _common_dimension(
    terms: object, known: Mapping[sp.Basic, Dimension], where: str
) -> Dimension | None:
    result: Dimension | None = None
    for term in terms:  # type: ignore[attr-defined]
        term_dimension = dimension_of(term, known)
        if term_dimension is None or term_dimension == result:
            continue
        if result is not None:
            raise UnitMismatch(
                f"{where} adds {dimension_text(result)} and {dimension_text(term_dimension)}"
            )
        result = term_dimension
    return result


def _product_dimension(expression: sp.Mul, known: Mapping[sp.Basic, Dimension]) -> Dimension:
    total = list(_PURE_NUMBER)
    for factor in expression.args:
        factor_dimension = dimension_of(factor, known) or _PURE_NUMBER
        total = [t + h for t, h in zip(total, factor_dimension, strict=True)]
    return (total[0], total[1], total[2])


def _power_dimension(expression: sp.Pow, known: Mapping[sp.Basic, Dimension]) -> Dimension:
    base = dimension_of(expression.base, known) or _PURE_NUMBER
    if not expression.exp.is_number:
        if base != _PURE_NUMBER or dimension_of(expression.exp, known) not in (None, _PURE_NUMBER):
            raise UnitMismatch(f"{expression} raises {dimension_text(base)} to a power that varies")
        return _PURE_NUMBER
    power = sp.nsimplify(expression.exp)
    return (base[0] * power, base[1] * power, base[2] * power)
