"""A case of the atlas as data: scale of its parameter, definition, and result."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..optional_packages import missing_packages
from ..plain_data import stored_as, stored_keys

#: Measured points: pairs of the parameter and the error measure.
Points = tuple[tuple[float, float], ...]


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


@dataclass(frozen=True)
class MethodDefinition:
    """Method as a function of the case's parameter.

    `measure` returns the error measure; it raises NumericalFailure, or returns a number that is not
    finite, where there is no answer.
    """

    name: str
    measure: Callable[[float], float]


@dataclass(frozen=True)
class CaseDefinition:
    """Case: a parameter for which a method fails, the criterion, and the remedy.

    The method is measured between `low` and `high`: at one end it must hold, at the other fail.
    The remedy is measured from the failing end to `reach`.  A method fails where `measured` exceeds
    `limit`.  The case needs the packages of `extra`.
    """

    name: str
    title: str
    cause: str
    parameter: str
    unit: str
    low: float
    high: float
    scale: Scale
    measured: str
    limit: float
    method: MethodDefinition
    remedy: MethodDefinition
    reach: float
    source: str
    extra: str = ""

    @property
    def lacks(self) -> list[str]:
        """Packages needed by the case that are not installed."""
        return missing_packages(self.extra) if self.extra else []


@dataclass(frozen=True)
class CaseResult:
    """Result of a case: where a method fails, and how far its remedy holds.

    `fails_at` and `holds_at` are the two ends of the last bracket, in `unit`; `failing_side` is the
    side on which the method fails ("above" or "below").  `remedy_holds_to` is the end of the range
    that was measured, or, where `remedy_fails_at` is a number, the end of the range of the remedy.
    `points` and `remedy_points` are the measured points: pairs of the parameter and the error
    measure, infinite where there was no answer.
    """

    name: str
    title: str
    explanation: str = field(metadata=stored_as("why"))
    parameter: str
    unit: str
    scale: str
    measured: str
    limit: float
    method: str
    failing_side: str = field(metadata=stored_as("fails"))
    fails_at: float
    holds_at: float
    monotone: bool
    points: Points
    remedy: str
    remedy_holds_to: float
    remedy_fails_at: float | None
    remedy_monotone: bool
    remedy_points: Points
    source: str

    def to_dict(self) -> dict[str, Any]:
        """Convert to plain data; pairs become lists, infinite values None."""
        return {
            key: _finite_pairs(getattr(self, name)) for name, key in stored_keys(CaseResult).items()
        }


def _finite_pairs(value: Any) -> Any:
    if not isinstance(value, tuple):
        return value
    return [
        [parameter, None if measured == float("inf") else measured] for parameter, measured in value
    ]
