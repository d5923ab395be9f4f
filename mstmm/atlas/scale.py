"""Scales of a parameter: a grid between two ends, and the middle of a bracket."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Scale:
    """How a parameter is laid out: values and positions along an axis, one to one."""

    name: str
    position: Callable[[float], float]
    value: Callable[[float], float]

    def grid(self, low: float, high: float, points: int) -> tuple[float, ...]:
        """`points` values from `low` to `high`, both included; whole ones once each."""
        first, last = self.position(low), self.position(high)
        inner = (
            self.value(first + (last - first) * i / (points - 1)) for i in range(1, points - 1)
        )
        return tuple(dict.fromkeys((low, *inner, high)))

    def middle(self, one: float, other: float, tolerance: float) -> float | None:
        """The value halfway, or None where the two are as close as `tolerance` or nothing lies
        between."""
        a, b = self.position(one), self.position(other)
        width = abs(b - a) if self.name == "log" else abs(b - a) / max(abs(a), abs(b))
        half = self.value((a + b) / 2)
        if self.name == "count":
            half = (one + other) // 2
            return half if half not in (one, other) else None
        return half if width > tolerance and half not in (one, other) else None


LINEAR = Scale("linear", float, float)
LOG = Scale("log", math.log, math.exp)
#: Whole numbers, evenly in their logarithms.
COUNT = Scale("count", math.log, lambda position: float(round(math.exp(position))))
