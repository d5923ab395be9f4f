"""The operations of `ir.OPERATIONS` on plain floats and on mpmath numbers.

Both follow IEEE 754 where a real value does not exist: NaN outside the domain, infinities at
poles and on overflow.  Truth is 1 or 0; what is neither zero nor NaN is true.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any, ClassVar, Protocol

import mpmath

from mstmm.ir import Constant

Operation = Callable[..., Any]


class Arithmetic(Protocol):
    """What an evaluation needs: conversion of inputs and constants, and the operations."""

    @property
    def operations(self) -> Mapping[str, Operation]:
        """Operation name -> function."""

    def number(self, value: Any) -> Any:
        """An input as a number of this arithmetic."""

    def constant(self, constant: Constant) -> Any:
        """A constant of the kernel as a number of this arithmetic."""

    def true(self, value: Any) -> bool:
        """Whether the value is neither zero nor NaN."""


def _true(value: Any) -> bool:
    return bool(abs(value) > 0)


def _shared(number: Callable[[int], Any], is_nan: Callable[[Any], bool]) -> dict[str, Operation]:
    """Operations that need comparison and + - * only."""
    one, zero = number(1), number(0)

    def truth(value: bool) -> Any:
        return one if value else zero

    def sign(a: Any) -> Any:
        return one if a > 0 else (-one if a < 0 else a)

    return {
        "neg": lambda a: -a,
        "add": lambda a, b: a + b,
        "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b,
        "abs": abs,
        "sign": sign,
        "min": lambda a, b: a if a < b or is_nan(a) else b,
        "max": lambda a, b: b if a < b or is_nan(b) else a,
        "lt": lambda a, b: truth(a < b),
        "le": lambda a, b: truth(a <= b),
        "eq": lambda a, b: truth(a == b),
        "and": lambda a, b: truth(_true(a) and _true(b)),
        "or": lambda a, b: truth(_true(a) or _true(b)),
        "not": lambda a: truth(a == 0),
        "select": lambda c, a, b: a if _true(c) else b,
    }


# --- plain floats ------------------------------------------------------------------------------


def _guarded(function: Operation, overflow: Callable[[float], float] | None = None) -> Operation:
    """The C value where Python raises: NaN outside the domain, an infinity on overflow."""

    def call(a: float) -> float:
        try:
            return float(function(a))
        except ValueError:
            return math.nan
        except OverflowError:
            return overflow(a) if overflow is not None else math.inf

    return call


def _divide(a: float, b: float) -> float:
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def _log(a: float) -> float:
    return -math.inf if a == 0 else _guarded(math.log)(a)


def _floor(a: float) -> float:
    return math.copysign(float(math.floor(a)), a) if math.isfinite(a) else a


def _odd(a: float) -> bool:
    return math.isfinite(a) and a == math.floor(a) and math.fmod(a, 2.0) != 0


def _power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except ValueError:
        if a == 0:
            return math.copysign(math.inf, a) if _odd(b) else math.inf
        return math.nan
    except OverflowError:
        return -math.inf if a < 0 and _odd(b) else math.inf


class FloatArithmetic:
    """Doubles, with the values C gives."""

    operations: ClassVar[dict[str, Operation]] = {
        **_shared(float, math.isnan),
        "div": _divide,
        "pow": _power,
        "sqrt": _guarded(math.sqrt),
        "sin": _guarded(math.sin),
        "cos": _guarded(math.cos),
        "tan": _guarded(math.tan),
        "asin": _guarded(math.asin),
        "acos": _guarded(math.acos),
        "atan": math.atan,
        "atan2": math.atan2,
        "sinh": _guarded(math.sinh, lambda a: math.copysign(math.inf, a)),
        "cosh": _guarded(math.cosh),
        "tanh": math.tanh,
        "exp": _guarded(math.exp),
        "log": _log,
        "floor": _floor,
    }

    def number(self, value: Any) -> float:
        return float(value)

    def constant(self, constant: Constant) -> float:
        return constant.number

    def true(self, value: Any) -> bool:
        return _true(value)


# --- mpmath ------------------------------------------------------------------------------------


#: Operations that mpmath calls by the same name.
_MPMATH_NAMES = (
    "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp",
)  # fmt: skip


@lru_cache(maxsize=16)
def _context(digits: int) -> Any:
    """A context of its own, so that nobody's precision is touched."""
    context = mpmath.MPContext()
    context.dps = digits
    return context


class PreciseArithmetic:
    """Numbers of `digits` decimal digits."""

    def __init__(self, digits: int) -> None:
        self._context = context = _context(digits)

        def real(function: Operation) -> Operation:
            """NaN where the value is complex, an infinity of the right sign at a pole."""

            def call(*operands: Any) -> Any:
                try:
                    value = function(*operands)
                except ZeroDivisionError:
                    return context.inf
                return value if isinstance(value, context.mpf) else context.nan

            return call

        def divide(a: Any, b: Any) -> Any:
            if b != 0:
                return a / b
            return context.nan if a == 0 or context.isnan(a) else context.sign(a) * context.inf

        def power(a: Any, b: Any) -> Any:
            fractional = context.isinf(b) or b != context.floor(b)
            base = abs(a) if fractional and (context.isinf(a) or context.isinf(b)) else a
            return context.one if base == 1 or b == 0 else real(context.power)(base, b)

        def angle(a: Any, b: Any) -> Any:
            if context.isnan(a) or context.isnan(b):
                return context.nan
            if context.isinf(a) and context.isinf(b):
                a, b = context.sign(a), context.sign(b)
            return real(context.atan2)(a, b)

        self.operations: dict[str, Operation] = {
            **_shared(context.mpf, context.isnan),
            **{name: real(getattr(context, name)) for name in _MPMATH_NAMES},
            "div": divide,
            "pow": power,
            "atan2": angle,
            "log": lambda a: -context.inf if a == 0 else real(context.log)(a),
            "floor": lambda a: context.floor(a) if context.isfinite(a) else a,
        }

    def number(self, value: Any) -> Any:
        if isinstance(value, Fraction):
            return self._context.mpf(value.numerator) / value.denominator
        if hasattr(value, "_mpf_"):
            return self._context.make_mpf(value._mpf_)
        return self._context.mpf(value)

    def constant(self, constant: Constant) -> Any:
        if constant.text == "pi":
            return +self._context.pi
        return self.number(Fraction(constant.text))

    def true(self, value: Any) -> bool:
        return _true(value)
