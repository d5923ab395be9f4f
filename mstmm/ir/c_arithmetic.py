"""Functions of doubles that return the values of C where Python would raise an exception.

The values are NaN outside the domain, and infinities at poles and on overflow.
"""

from __future__ import annotations

import math
from collections.abc import Callable

Function = Callable[[float], float]


def with_c_limits(function: Function, overflow: Function | None = None) -> Function:
    """Wrap `function`: NaN outside its domain, an infinity on overflow."""

    def call(a: float) -> float:
        try:
            return float(function(a))
        except ValueError:
            return math.nan
        except OverflowError:
            return overflow(a) if overflow is not None else math.inf

    return call


def divide(a: float, b: float) -> float:
    """Quotient a / b, NaN or an infinity for b = 0."""
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def log(a: float) -> float:
    """Natural logarithm, minus infinity at 0."""
    return -math.inf if a == 0 else with_c_limits(math.log)(a)


def floor(a: float) -> float:
    """Largest integer not above `a`, as a double with the sign of `a`."""
    return math.copysign(float(math.floor(a)), a) if math.isfinite(a) else a


def power(a: float, b: float) -> float:
    """Power a ** b; NaN where no real value exists."""
    try:
        return math.pow(a, b)
    except ValueError:
        if a == 0:
            return math.copysign(math.inf, a) if _is_odd(b) else math.inf
        return math.nan
    except OverflowError:
        return -math.inf if a < 0 and _is_odd(b) else math.inf


def _is_odd(a: float) -> bool:
    return math.isfinite(a) and a == math.floor(a) and math.fmod(a, 2.0) != 0
