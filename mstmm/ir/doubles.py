"""Functions of doubles with the values C gives where Python raises.

Where a real value does not exist: NaN outside the domain, infinities at poles and on overflow.
"""

from __future__ import annotations

import math
from collections.abc import Callable

Function = Callable[[float], float]


def guarded(function: Function, overflow: Function | None = None) -> Function:
    """NaN outside the domain of `function`, an infinity on overflow."""

    def call(a: float) -> float:
        try:
            return float(function(a))
        except ValueError:
            return math.nan
        except OverflowError:
            return overflow(a) if overflow is not None else math.inf

    return call


def divide(a: float, b: float) -> float:
    """a / b."""
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def log(a: float) -> float:
    """The natural logarithm."""
    return -math.inf if a == 0 else guarded(math.log)(a)


def floor(a: float) -> float:
    """The largest whole number that is not above."""
    return math.copysign(float(math.floor(a)), a) if math.isfinite(a) else a


def power(a: float, b: float) -> float:
    """a to the power b."""
    try:
        return math.pow(a, b)
    except ValueError:
        if a == 0:
            return math.copysign(math.inf, a) if _odd(b) else math.inf
        return math.nan
    except OverflowError:
        return -math.inf if a < 0 and _odd(b) else math.inf


def _odd(a: float) -> bool:
    return math.isfinite(a) and a == math.floor(a) and math.fmod(a, 2.0) != 0
