"""Dimensions of SymPy expressions, to check the units of a definition."""

from __future__ import annotations

import re
from collections.abc import Mapping

import sympy as sp

from mstmm.errors import ElementError

#: Exponents of m, kg, s; angles count as numbers.
Dimension = tuple[sp.Rational, sp.Rational, sp.Rational]

_NONE = (sp.Integer(0),) * 3
_UNITS: dict[str, tuple[int, int, int]] = {
    "": (0, 0, 0), "1": (0, 0, 0), "rad": (0, 0, 0), "turn": (0, 0, 0),
    "m": (1, 0, 0), "kg": (0, 1, 0), "s": (0, 0, 1), "Hz": (0, 0, -1),
    "N": (1, 1, -2), "J": (2, 1, -2), "W": (2, 1, -3), "Pa": (-1, 1, -2),
}  # fmt: skip
_FACTOR = re.compile(r"([A-Za-z]+|1)\s*(?:\^|\*\*)?\s*(-?\d+)?")


def dimension(unit: str) -> Dimension:
    """Dimension of a unit such as "N*m/rad", "kg*m2", "m/s^2".  ElementError for unknown ones."""
    total = list(_NONE)
    above = True
    for part in re.split(r"([*/ ])", unit.replace("·", "*").strip()):
        if part in ("*", " ", ""):
            continue
        if part == "/":
            above = False
            continue
        match = _FACTOR.fullmatch(part)
        if match is None or match[1] not in _UNITS:
            raise ElementError(
                f"unit {unit!r}: unknown unit {part!r}; use m, kg, s, rad, N, J, W, Pa, Hz"
            )
        power = int(match[2] or 1) * (1 if above else -1)
        total = [t + power * e for t, e in zip(total, _UNITS[match[1]], strict=True)]
    return (total[0], total[1], total[2])


def text(dimensions: Dimension) -> str:
    """Dimension as a product of SI units."""
    parts = [
        name if power == 1 else f"{name}^{power}"
        for name, power in zip(("m", "kg", "s"), dimensions, strict=True)
        if power != 0
    ]
    return "*".join(parts) or "a pure number"


class Misfit(Exception):
    """A sum or function whose operands have incompatible dimensions; the message names them."""


def dimension_of(expression: sp.Expr, known: Mapping[sp.Basic, Dimension]) -> Dimension | None:
    """Dimension of an expression; None for zero, which has any dimension.  Raises Misfit."""
    if expression == 0:
        return None
    if expression.is_number:
        return _NONE
    if expression in known:
        return known[expression]
    if isinstance(expression, sp.Add):
        return _common(expression.args, known, f"the sum {expression}")
    if isinstance(expression, (sp.Min, sp.Max)):
        return _common(expression.args, known, str(expression))
    if isinstance(expression, sp.Mul):
        return _product(expression, known)
    if isinstance(expression, sp.Pow):
        return _power(expression, known)
    if isinstance(expression, sp.Abs):
        return dimension_of(expression.args[0], known)
    if isinstance(expression, sp.Piecewise):
        return _common([value for value, _ in expression.args], known, str(expression))
    if isinstance(expression, sp.sign):
        dimension_of(expression.args[0], known)
        return _NONE
    if isinstance(expression, sp.atan2):
        _common(expression.args, known, str(expression))
        return _NONE
    for argument in expression.args:
        found = dimension_of(argument, known)
        if found not in (None, _NONE):
            raise Misfit(
                f"{expression.func}({argument}) expects a pure number, found {text(found)}"
            )
    return _NONE


def _common(terms: object, known: Mapping[sp.Basic, Dimension], where: str) -> Dimension | None:
    found: Dimension | None = None
    for term in terms:  # type: ignore[attr-defined]
        here = dimension_of(term, known)
        if here is None or here == found:
            continue
        if found is not None:
            raise Misfit(f"{where} adds {text(found)} and {text(here)}")
        found = here
    return found


def _product(expression: sp.Mul, known: Mapping[sp.Basic, Dimension]) -> Dimension:
    total = list(_NONE)
    for factor in expression.args:
        here = dimension_of(factor, known) or _NONE
        total = [t + h for t, h in zip(total, here, strict=True)]
    return (total[0], total[1], total[2])


def _power(expression: sp.Pow, known: Mapping[sp.Basic, Dimension]) -> Dimension:
    base = dimension_of(expression.base, known) or _NONE
    if not expression.exp.is_number:
        if base != _NONE or dimension_of(expression.exp, known) not in (None, _NONE):
            raise Misfit(f"{expression} raises {text(base)} to a power that varies")
        return _NONE
    power = sp.nsimplify(expression.exp)
    return (base[0] * power, base[1] * power, base[2] * power)
