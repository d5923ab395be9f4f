"""Scales of a parameter: a grid between two ends, and the midpoint of a bracket."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Scale:
    """Scale of a parameter: a one-to-one map between values and positions on an axis."""

    name: str
    position: Callable[[float], float]
    value: Callable[[float], float]

    def grid(self, low: float, high: float, points: int) -> tuple[float, ...]:
        """Grid of `points` values from `low` to `high`, both included, without duplicates."""
        first, last = self.position(low), self.position(high)
        inner = (
            self.value(first + (last - first) * i / (points - 1)) for i in range(1, points - 1)
        )
        return tuple(dict.fromkeys((low, *inner, high)))

    def middle(self, one: float, other: float, tolerance: float) -> float | None:
        """Midpoint of a bracket, or None if it is within `tolerance` or has no value inside."""
        a, b = self.position(one), self.position(other)
        width = abs(b - a) if self.name == "log" else abs(b - a) / max(abs(a), abs(b))
        midpoint = self.value((a + b) / 2)
        if self.name == "count":
            midpoint = (one + other) // 2
            return midpoint if midpoint not in (one, other) else None
        return midpoint if width > tolerance and midpoint not in (one, other) else None


LINEAR_SCALE = Scale("linear", float, float)
LOG_SCALE = Scale("log", math.log, math.exp)
#: Integers, equidistant in their logarithms.
COUNT_SCALE = Scale("count", math.log, lambda position: float(round(math.exp(position))))
