"""Bounds of the terms of an expression, and of their time derivatives, over intervals of time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.expression.expression import Expression
from mstmm.expression.parser import Term

from . import interval_arithmetic as iv
from .interval_arithmetic import EVERYTHING, Interval, as_interval

_ONE, _ZERO = as_interval(1.0), as_interval(0.0)

#: Name of time in expressions.
TIME = "t"


@dataclass(frozen=True)
class Enclosure:
    """Bounds of a value and of its derivative with respect to t."""

    value: Interval
    slope: Interval

    def __sub__(self, other: Enclosure) -> Enclosure:
        return Enclosure(self.value - other.value, self.slope - other.slope)


def terms_of_time(
    expression: Expression, constants: Mapping[str, float]
) -> tuple[list[int], list[int]]:
    """Split terms: (those that depend on t and constants only, those of them that contain t)."""
    return terms_of_names(expression, constants, (TIME,))


def terms_of_names(
    expression: Expression, constants: Mapping[str, float], variables: Collection[str]
) -> tuple[list[int], list[int]]:
    """Split terms as `terms_of_time` does, with the names `variables` instead of t."""
    closed_terms, varying_terms = set[int](), set[int]()
    for index in sorted(expression.required_terms):
        term = expression.terms[index]
        if term.constant is not None or _is_known(term, constants):
            closed_terms.add(index)
        elif term.name is not None:
            if term.name.text in variables:
                closed_terms.add(index)
                varying_terms.add(index)
        elif all(i in closed_terms for i in term.args):
            closed_terms.add(index)
            if any(i in varying_terms for i in term.args):
                varying_terms.add(index)
    return sorted(closed_terms), sorted(varying_terms)


def enclose(
    terms: Sequence[Term],
    wanted: Sequence[int],
    constants: Mapping[str, float],
    leaves: Mapping[str, Enclosure],
) -> dict[int, Enclosure]:
    """Enclosures of the terms `wanted` over cells, by index; arguments precede their operations.

    `leaves` are the enclosures of the names that vary.
    """
    enclosures: dict[int, Enclosure] = {}
    with np.errstate(all="ignore"):
        for index in wanted:
            term = terms[index]
            if term.constant is not None:
                exact = term.exact is not None and float(term.exact) == term.exact
                x = np.asarray(term.constant)
                value = as_interval(x) if exact else Interval(np.nextafter(x, -np.inf),
                                                        np.nextafter(x, np.inf))  # fmt: skip
                enclosures[index] = Enclosure(value, _ZERO)
            elif term.name is not None:
                text = term.name.text
                enclosures[index] = (
                    leaves[text]
                    if text in leaves
                    else Enclosure(as_interval(constants[text]), _ZERO)
                )
            else:
                exponent = terms[term.args[1]].constant if term.op == "pow" else None
                enclosures[index] = _apply(term.op, [enclosures[i] for i in term.args], exponent)
    return enclosures


def _is_known(term: Term, constants: Mapping[str, float]) -> bool:
    return term.name is not None and term.name.text in constants


def identity_enclosure(t: Interval) -> Enclosure:
    """Enclosure of a variable over cells of that variable."""
    return Enclosure(t, _ONE)


# --- operations -----------------------------------------------------------------------------------


def _apply(op: str, args: list[Enclosure], exponent: float | None) -> Enclosure:
    values, slopes = [a.value for a in args], [a.slope for a in args]
    if op == "pow":
        return _power(args, exponent)
    if op in _FUNCTIONS:
        function, derivative = _FUNCTIONS[op]
        value = function(values[0])
        return Enclosure(value, derivative(values[0], value) * slopes[0])
    if op in ("lt", "le", "gt", "ge"):
        a, b = values if op in ("lt", "le") else values[::-1]
        return Enclosure(iv.certainly_less(a, b, op in ("le", "ge")), EVERYTHING)
    return _COMBINED[op](values, slopes)


def _power(args: list[Enclosure], exponent: float | None) -> Enclosure:
    """Enclosure of a power: a^n for an integer exponent, exp(b log a) for all others."""
    base, exponent_bounds = args
    if exponent is not None and exponent == int(exponent) and abs(exponent) < 2**31:
        n = int(exponent)
        slope = as_interval(float(n)) * iv.integer_power(base.value, n - 1) if n else _ZERO
        return Enclosure(iv.integer_power(base.value, n), slope * base.slope)
    logarithm = iv.log(base.value)
    value = iv.bound_increasing(np.exp, exponent_bounds.value * logarithm)
    rate = exponent_bounds.slope * logarithm + exponent_bounds.value * base.slope / base.value
    return Enclosure(value, value * rate)


def _multiply(v: list[Interval], d: list[Interval]) -> Enclosure:
    return Enclosure(v[0] * v[1], d[0] * v[1] + v[0] * d[1])


def _divide(v: list[Interval], d: list[Interval]) -> Enclosure:
    value = v[0] / v[1]
    return Enclosure(value, (d[0] - value * d[1]) / v[1])


def _sign(v: list[Interval], d: list[Interval]) -> Enclosure:
    lo, hi = np.sign(v[0].lo), np.sign(v[0].hi)
    flat = Interval(np.where(lo == hi, 0.0, -np.inf), np.where(lo == hi, 0.0, np.inf))
    return Enclosure(Interval(lo, hi), flat)


def _abs(v: list[Interval], d: list[Interval]) -> Enclosure:
    side = Interval(np.where(v[0].lo > 0, 1.0, -1.0), np.where(v[0].hi < 0, -1.0, 1.0))
    return Enclosure(iv.absolute(v[0]), side * d[0])


def _extreme(v: list[Interval], d: list[Interval], largest: bool) -> Enclosure:
    choose = np.maximum if largest else np.minimum
    value = Interval(choose(v[0].lo, v[1].lo), choose(v[0].hi, v[1].hi))
    is_first = (
        iv.certainly_less(v[1], v[0], False) if largest else iv.certainly_less(v[0], v[1], False)
    )
    return Enclosure(value, is_first.select(d[0], d[1]))


def _atan2(v: list[Interval], d: list[Interval]) -> Enclosure:
    """Enclosure between the angles of the corners if the cell misses branch cut and origin."""
    y, x = v
    corners = [np.arctan2(b, a) for a in (x.lo, x.hi) for b in (y.lo, y.hi)]
    cut = y.contains_zero & (x.lo <= 0)
    lo, hi = np.minimum.reduce(corners), np.maximum.reduce(corners)
    value = Interval(np.where(cut, -np.pi, lo - 1e-15), np.where(cut, np.pi, hi + 1e-15))
    size = iv.integer_power(x, 2) + iv.integer_power(y, 2)
    slope = (x * d[0] - y * d[1]) / size
    return Enclosure(value, Interval(np.where(cut, -np.inf, slope.lo),
                                     np.where(cut, np.inf, slope.hi)))  # fmt: skip


def _where(v: list[Interval], d: list[Interval]) -> Enclosure:
    """Enclosure of `where`; the slope is unbounded where the condition may switch."""
    is_uncertain = v[0].contains_zero & (v[0].hi > 0)
    slope = v[0].select(d[1], d[2])
    slope_bounds = Interval(
        np.where(is_uncertain, -np.inf, slope.lo), np.where(is_uncertain, np.inf, slope.hi)
    )
    return Enclosure(v[0].select(v[1], v[2]), slope_bounds)


_Slope = Callable[[Interval, Interval], Interval]

#: Function of one argument -> its bounds, and bounds of its derivative from argument and value.
_FUNCTIONS: dict[str, tuple[Callable[[Interval], Interval], _Slope]] = {
    "sin": (iv.sin, lambda x, _: iv.cos(x)),
    "cos": (iv.cos, lambda x, _: -iv.sin(x)),
    "tan": (lambda x: iv.sin(x) / iv.cos(x), lambda x, _: _ONE / iv.integer_power(iv.cos(x), 2)),
    "asin": (
        lambda x: iv.bound_increasing(np.arcsin, x.within(-1, 1)),
        lambda x, _: _ONE / iv.sqrt(_ONE - iv.integer_power(x, 2)),
    ),
    "acos": (
        lambda x: iv.bound_decreasing(np.arccos, x.within(-1, 1)),
        lambda x, _: -_ONE / iv.sqrt(_ONE - iv.integer_power(x, 2)),
    ),
    "atan": (
        lambda x: iv.bound_increasing(np.arctan, x),
        lambda x, _: _ONE / (_ONE + iv.integer_power(x, 2)),
    ),
    "sinh": (
        lambda x: iv.bound_increasing(np.sinh, x),
        lambda x, _: iv.bound_increasing(np.cosh, iv.absolute(x)).within(1, np.inf),
    ),
    "cosh": (
        lambda x: iv.bound_increasing(np.cosh, iv.absolute(x)),
        lambda x, _: iv.bound_increasing(np.sinh, x),
    ),
    "tanh": (
        lambda x: iv.bound_increasing(np.tanh, x),
        lambda _, v: (_ONE - iv.integer_power(v, 2)).within(0, 1),
    ),
    "exp": (lambda x: iv.bound_increasing(np.exp, x), lambda _, v: v),
    "log": (iv.log, lambda x, _: _ONE / x.within(0, np.inf)),
    "sqrt": (iv.sqrt, lambda _, v: as_interval(0.5) / v),
}

_Combined = Callable[[list[Interval], list[Interval]], Enclosure]

_COMBINED: dict[str, _Combined] = {
    "neg": lambda v, d: Enclosure(-v[0], -d[0]),
    "add": lambda v, d: Enclosure(v[0] + v[1], d[0] + d[1]),
    "sub": lambda v, d: Enclosure(v[0] - v[1], d[0] - d[1]),
    "mul": _multiply,
    "div": _divide,
    "sign": _sign,
    "abs": _abs,
    "min": lambda v, d: _extreme(v, d, False),
    "max": lambda v, d: _extreme(v, d, True),
    "atan2": _atan2,
    "where": _where,
}
