"""Dual numbers: values with their exact derivatives by the parameters of a scene.

The code that turns the numbers of a scene into kernel data (frames, mass moments, axes) runs
unchanged on Dual numbers.  Values are computed by the same operations in the same order, so they
are bit for bit those of plain floats.

A Dual is not a float: `float(dual)` raises TypeError, and so do arrays of doubles.  The same code
runs on Formulas (`formula`), which the functions below accept as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .symbolic_number import (
    Formula,
    OrderedByValue,
    apply_function,
    formula,
    sum_with_value,
    vector_length,
)

#: Derivatives by parameter number; exact zeros are omitted.
Derivatives = Mapping[int, float]


class Dual(OrderedByValue):
    """Number `value` with its derivatives slope[k] = d value / d parameter k.

    Ordered by value.  A Dual equals a float only where every derivative is zero, so that a zero
    that depends on a parameter is no structural zero.
    """

    __slots__ = ("slope", "value")

    def __init__(self, value: float, slope: Derivatives) -> None:
        self.value = value
        self.slope = {k: s for k, s in slope.items() if s != 0}

    def __bool__(self) -> bool:
        return bool(self.slope) or self.value != 0

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Dual):
            return self.value == other.value and self.slope == other.slope
        return not self.slope and self.value == other

    def __hash__(self) -> int:
        return hash(self.value)

    def __neg__(self) -> Dual:
        return Dual(-self.value, {k: -s for k, s in self.slope.items()})

    def __abs__(self) -> Dual:
        return -self if math.copysign(1.0, self.value) < 0 else self

    def __add__(self, other: Any) -> Any:
        return chain_rule(self.value + value_of(other), [(self, 1.0), (other, 1.0)])

    __radd__ = __add__

    def __sub__(self, other: Any) -> Any:
        return chain_rule(self.value - value_of(other), [(self, 1.0), (other, -1.0)])

    def __rsub__(self, other: float) -> Any:
        return chain_rule(other - self.value, [(self, -1.0)])

    def __mul__(self, other: Any) -> Any:
        factor = value_of(other)
        return chain_rule(self.value * factor, [(self, factor), (other, self.value)])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Any:
        divisor = value_of(other)
        ratio = self.value / divisor
        return chain_rule(ratio, [(self, 1 / divisor), (other, -ratio / divisor)])

    def __rtruediv__(self, other: float) -> Any:
        ratio = other / self.value
        return chain_rule(ratio, [(self, -ratio / self.value)])


# Below, numbers are typed as floats: a Dual or Formula may replace any scene number.

_DERIVATIVE_TYPES = frozenset({Dual, Formula})


def value_of(number: Any) -> float:
    """Value of a number as a float, without its derivatives or terms."""
    return number.value if isinstance(number, (Dual, Formula)) else float(number)


def to_real(number: Any) -> float:
    """Convert a number to float; leave a Dual or Formula unchanged."""
    result: Any = number
    return result if type(number) in (float, Dual, Formula) else float(number)


def chain_rule(value: float, partials: Iterable[tuple[Any, float]]) -> Any:
    """Dual of `value` by the chain rule, from (number, partial derivative) pairs.

    Returns a plain float where no number is a Dual.
    """
    derivatives: dict[int, float] = {}
    has_dual = False
    for number, partial in partials:
        if isinstance(number, Dual):
            has_dual = True
            for k, s in number.slope.items():
                derivatives[k] = derivatives.get(k, 0.0) + partial * s
    return Dual(value, derivatives) if has_dual else value


def has_dual_or_formula(numbers: Iterable[object]) -> bool:
    """Whether any of the numbers is a Dual or a Formula."""
    return not _DERIVATIVE_TYPES.isdisjoint(map(type, numbers))  # much faster than a Python loop


def has_formula(numbers: Iterable[object]) -> bool:
    """Whether any of the numbers is a Formula."""
    return Formula in map(type, numbers)


def hypot(v: Sequence[float]) -> float:
    """Euclidean length without overflow or underflow of the squares."""
    if not has_dual_or_formula(v):
        return math.hypot(*v)
    length = math.hypot(*map(value_of, v))
    if has_formula(v):
        return vector_length(v, length)
    partials = [(x, value_of(x) / length if length else 0.0) for x in v]
    return chain_rule(length, partials)


def fsum(numbers: Sequence[float]) -> float:
    """Sum, rounded once."""
    if not has_dual_or_formula(numbers):
        return math.fsum(numbers)
    value = math.fsum(map(value_of, numbers))
    if has_formula(numbers):
        return sum_with_value(numbers, value)
    return chain_rule(value, [(x, 1.0) for x in numbers])


def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y), rad."""
    a, b = value_of(y), value_of(x)
    if has_formula([y, x]):
        return apply_function("atan2", (formula(y), formula(x)), math.atan2(a, b))
    square = a * a + b * b
    partials = [(y, b / square), (x, -a / square)]
    return chain_rule(math.atan2(a, b), partials)
