"""Interval arithmetic: bounds of the terms of an expression, and of their derivatives, over cells.

Bounds are rounded outwards, functions of the C library by four units in the last place, so that
every value computed in double precision is inside.  An empty interval, where a function has no
value, is nan.  R. E. Moore, Interval Analysis, Prentice-Hall (1966).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array
from mstmm.expression.expression import Expression
from mstmm.expression.parser import Term

_LIBRARY_ERROR = 1e-15


@dataclass(frozen=True)
class Interval:
    """Numbers between `lo` and `hi`: arrays of equal shape, or scalars that hold for all cells."""

    lo: Array
    hi: Array

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: Interval) -> Interval:
        return _round_outward(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: Interval) -> Interval:
        return self + -other

    def __mul__(self, other: Interval) -> Interval:
        corners = (self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)
        products = [np.where(np.isnan(x), 0.0, x) for x in corners]  # 0 times infinity
        product = _round_outward(np.minimum.reduce(products), np.maximum.reduce(products))
        return product._without(np.isnan(self.lo) | np.isnan(other.lo))

    def __truediv__(self, other: Interval) -> Interval:
        meets_zero = (other.lo <= 0) & (other.hi >= 0)
        safe_bounds = np.where(meets_zero, np.nan, other.lo), np.where(meets_zero, np.nan, other.hi)
        quotient = self * _round_outward(1 / safe_bounds[1], 1 / safe_bounds[0])
        lo, hi = (
            np.where(meets_zero, -np.inf, quotient.lo),
            np.where(meets_zero, np.inf, quotient.hi),
        )
        return Interval(lo, hi)._without(np.isnan(self.lo) | np.isnan(other.lo))

    def _without(self, empty: NDArray[np.bool_]) -> Interval:
        return Interval(np.where(empty, np.nan, self.lo), np.where(empty, np.nan, self.hi))

    @property
    def width(self) -> Array:
        """Width hi - lo; nan where empty."""
        return np.asarray(self.hi - self.lo)

    @property
    def contains_zero(self) -> NDArray[np.bool_]:
        """Mask of the intervals that contain zero."""
        return np.asarray((self.lo <= 0) & (self.hi >= 0))

    @property
    def is_one_sided(self) -> NDArray[np.bool_]:
        """Mask of the intervals whose numbers are all positive or all negative."""
        return np.asarray((self.lo > 0) | (self.hi < 0))

    def within(self, lo: float, hi: float) -> Interval:
        """Intersection with [lo, hi]."""
        clipped = Interval(np.maximum(self.lo, lo), np.minimum(self.hi, hi))
        return clipped._without((self.lo > hi) | (self.hi < lo))

    def hull(self, other: Interval) -> Interval:
        """Smallest interval that contains both intervals."""
        return Interval(np.fmin(self.lo, other.lo), np.fmax(self.hi, other.hi))

    def intersect(self, other: Interval) -> Interval:
        """Intersection of two intervals; where one is empty, the other one."""
        return Interval(np.fmax(self.lo, other.lo), np.fmin(self.hi, other.hi))

    def select(self, a: Interval, b: Interval) -> Interval:
        """`a` where this interval excludes zero, `b` where it is zero, else the hull of both."""
        union, is_nonzero, is_zero = a.hull(b), self.is_one_sided, (self.lo == 0) & (self.hi == 0)
        lo = np.where(is_nonzero, a.lo, np.where(is_zero, b.lo, union.lo))
        return Interval(lo, np.where(is_nonzero, a.hi, np.where(is_zero, b.hi, union.hi)))


def as_interval(value: ArrayLike) -> Interval:
    """Interval of width zero at each number."""
    numbers = np.asarray(value, dtype=np.float64)
    return Interval(numbers, numbers)


EVERYTHING = Interval(np.asarray(-np.inf), np.asarray(np.inf))


def _round_outward(lo: Array, hi: Array) -> Interval:
    return Interval(np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf))


def _widen_library_result(lo: Array, hi: Array) -> Interval:
    """Widen results of the C library by its error, a few units in the last place."""
    return _round_outward(lo - _LIBRARY_ERROR * np.abs(lo), hi + _LIBRARY_ERROR * np.abs(hi))


def bound_increasing(function: Callable[[Array], Array], x: Interval) -> Interval:
    """Bounds of a non-decreasing function."""
    return _widen_library_result(function(x.lo), function(x.hi))


def bound_decreasing(function: Callable[[Array], Array], x: Interval) -> Interval:
    """Bounds of a non-increasing function."""
    return _widen_library_result(function(x.hi), function(x.lo))


def _contains_extremum(x: Interval, first: float) -> NDArray[np.bool_]:
    """Mask of the cells that contain a point first + 2 pi k."""
    tolerance = 4e-16 * np.maximum(np.abs(x.lo), np.abs(x.hi))
    a = np.floor((x.lo - tolerance - first) / (2 * np.pi))
    return np.asarray(np.floor((x.hi + tolerance - first) / (2 * np.pi)) != a)


def cos(x: Interval) -> Interval:
    """Bounds of the cosine."""
    end_values = np.cos(x.lo), np.cos(x.hi)
    bounds = _widen_library_result(np.minimum(*end_values), np.maximum(*end_values))
    lo, hi = (
        np.where(_contains_extremum(x, np.pi), -1.0, bounds.lo),
        np.where(_contains_extremum(x, 0.0), 1.0, bounds.hi),
    )
    return Interval(lo, hi)._without(np.isnan(x.lo))


def sin(x: Interval) -> Interval:
    """Bounds of the sine."""
    end_values = np.sin(x.lo), np.sin(x.hi)
    bounds = _widen_library_result(np.minimum(*end_values), np.maximum(*end_values))
    lo = np.where(_contains_extremum(x, -np.pi / 2), -1.0, bounds.lo)
    hi = np.where(_contains_extremum(x, np.pi / 2), 1.0, bounds.hi)
    return Interval(lo, hi)._without(np.isnan(x.lo))


def absolute(x: Interval) -> Interval:
    """Bounds of the absolute value."""
    abs_lo, abs_hi = np.abs(x.lo), np.abs(x.hi)
    return Interval(
        np.where(x.contains_zero, 0.0, np.minimum(abs_lo, abs_hi)), np.maximum(abs_lo, abs_hi)
    )


def integer_power(x: Interval, n: int) -> Interval:
    """Bounds of x^n for an integer n."""
    if n < 0:
        return as_interval(1.0) / integer_power(x, -n)
    if n % 2 == 0:
        size = absolute(x)
        return _widen_library_result(size.lo**n, size.hi**n).within(0.0, np.inf)
    return _widen_library_result(x.lo**n, x.hi**n)


def log(x: Interval) -> Interval:
    """Bounds of the natural logarithm; empty for negative numbers."""
    return bound_increasing(np.log, x.within(0.0, np.inf))


def sqrt(x: Interval) -> Interval:
    """Bounds of the square root; empty for negative numbers."""
    return bound_increasing(np.sqrt, x.within(0.0, np.inf))


def certainly_less(a: Interval, b: Interval, or_equal: bool) -> Interval:
    """1 where a < b (or a <= b) certainly holds, 0 where it cannot hold, else [0, 1]."""
    is_certain = a.hi <= b.lo if or_equal else a.hi < b.lo
    is_impossible = a.lo > b.hi if or_equal else a.lo >= b.hi
    return Interval(np.where(is_certain, 1.0, 0.0), np.where(is_impossible, 0.0, 1.0))


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
        is_known = term.name is not None and term.name.text in constants
        if term.constant is not None or is_known:
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
                enclosure = leaves.get(term.name.text)
                if enclosure is None:
                    enclosure = Enclosure(as_interval(constants[term.name.text]), _ZERO)
                enclosures[index] = enclosure
            else:
                exponent = terms[term.args[1]].constant if term.op == "pow" else None
                enclosures[index] = _apply(term.op, [enclosures[i] for i in term.args], exponent)
    return enclosures


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
        return Enclosure(certainly_less(a, b, op in ("le", "ge")), EVERYTHING)
    return _COMBINED[op](values, slopes)


def _power(args: list[Enclosure], exponent: float | None) -> Enclosure:
    """Enclosure of a power: a^n for an integer exponent, exp(b log a) for all others."""
    base, exponent_bounds = args
    if exponent is not None and exponent == int(exponent) and abs(exponent) < 2**31:
        n = int(exponent)
        slope = as_interval(float(n)) * integer_power(base.value, n - 1) if n else _ZERO
        return Enclosure(integer_power(base.value, n), slope * base.slope)
    logarithm = log(base.value)
    value = bound_increasing(np.exp, exponent_bounds.value * logarithm)
    rate = exponent_bounds.slope * logarithm + exponent_bounds.value * base.slope / base.value
    return Enclosure(value, value * rate)


def _divide(v: list[Interval], d: list[Interval]) -> Enclosure:
    value = v[0] / v[1]
    return Enclosure(value, (d[0] - value * d[1]) / v[1])


def _sign(v: list[Interval], d: list[Interval]) -> Enclosure:
    lo, hi = np.sign(v[0].lo), np.sign(v[0].hi)
    flat = Interval(np.where(lo == hi, 0.0, -np.inf), np.where(lo == hi, 0.0, np.inf))
    return Enclosure(Interval(lo, hi), flat)


def _abs(v: list[Interval], d: list[Interval]) -> Enclosure:
    side = Interval(np.where(v[0].lo > 0, 1.0, -1.0), np.where(v[0].hi < 0, -1.0, 1.0))
    return Enclosure(absolute(v[0]), side * d[0])


def _extreme(v: list[Interval], d: list[Interval], largest: bool) -> Enclosure:
    choose = np.maximum if largest else np.minimum
    value = Interval(choose(v[0].lo, v[1].lo), choose(v[0].hi, v[1].hi))
    is_first = certainly_less(v[1], v[0], False) if largest else certainly_less(v[0], v[1], False)
    return Enclosure(value, is_first.select(d[0], d[1]))


def _atan2(v: list[Interval], d: list[Interval]) -> Enclosure:
    """Enclosure between the angles of the corners if the cell misses branch cut and origin."""
    y, x = v
    corners = [np.arctan2(b, a) for a in (x.lo, x.hi) for b in (y.lo, y.hi)]
    cut = y.contains_zero & (x.lo <= 0)
    lo, hi = np.minimum.reduce(corners), np.maximum.reduce(corners)
    value = Interval(np.where(cut, -np.pi, lo - 1e-15), np.where(cut, np.pi, hi + 1e-15))
    size = integer_power(x, 2) + integer_power(y, 2)
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
    "sin": (sin, lambda x, _: cos(x)),
    "cos": (cos, lambda x, _: -sin(x)),
    "tan": (lambda x: sin(x) / cos(x), lambda x, _: _ONE / integer_power(cos(x), 2)),
    "asin": (
        lambda x: bound_increasing(np.arcsin, x.within(-1, 1)),
        lambda x, _: _ONE / sqrt(_ONE - integer_power(x, 2)),
    ),
    "acos": (
        lambda x: bound_decreasing(np.arccos, x.within(-1, 1)),
        lambda x, _: -_ONE / sqrt(_ONE - integer_power(x, 2)),
    ),
    "atan": (
        lambda x: bound_increasing(np.arctan, x),
        lambda x, _: _ONE / (_ONE + integer_power(x, 2)),
    ),
    "sinh": (
        lambda x: bound_increasing(np.sinh, x),
        lambda x, _: bound_increasing(np.cosh, absolute(x)).within(1, np.inf),
    ),
    "cosh": (
        lambda x: bound_increasing(np.cosh, absolute(x)),
        lambda x, _: bound_increasing(np.sinh, x),
    ),
    "tanh": (
        lambda x: bound_increasing(np.tanh, x),
        lambda _, v: (_ONE - integer_power(v, 2)).within(0, 1),
    ),
    "exp": (lambda x: bound_increasing(np.exp, x), lambda _, v: v),
    "log": (log, lambda x, _: _ONE / x.within(0, np.inf)),
    "sqrt": (sqrt, lambda _, v: as_interval(0.5) / v),
}

_Combined = Callable[[list[Interval], list[Interval]], Enclosure]

_COMBINED: dict[str, _Combined] = {
    "neg": lambda v, d: Enclosure(-v[0], -d[0]),
    "add": lambda v, d: Enclosure(v[0] + v[1], d[0] + d[1]),
    "sub": lambda v, d: Enclosure(v[0] - v[1], d[0] - d[1]),
    "mul": lambda v, d: Enclosure(v[0] * v[1], d[0] * v[1] + v[0] * d[1]),
    "div": _divide,
    "sign": _sign,
    "abs": _abs,
    "min": lambda v, d: _extreme(v, d, False),
    "max": lambda v, d: _extreme(v, d, True),
    "atan2": _atan2,
    "where": _where,
}
