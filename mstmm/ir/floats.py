"""The operations of `ir.OPERATIONS` on plain floats, as C computes them.

Where a real value does not exist: NaN outside the domain, infinities at poles and on overflow.
Truth is 1 or 0; what is neither zero nor NaN is true.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Protocol

from .statements import Constant

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


def true(value: Any) -> bool:
    """Whether a number is neither zero nor NaN."""
    return bool(abs(value) > 0)


def shared(number: Callable[[int], Any], is_nan: Callable[[Any], bool]) -> dict[str, Operation]:
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
        "and": lambda a, b: truth(true(a) and true(b)),
        "or": lambda a, b: truth(true(a) or true(b)),
        "not": lambda a: truth(a == 0),
        "select": lambda c, a, b: a if true(c) else b,
    }


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
        **shared(float, math.isnan),
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
        return true(value)
