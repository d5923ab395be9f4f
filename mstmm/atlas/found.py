"""What came out of a case, as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .frontier import Points


@dataclass(frozen=True)
class Found:
    """Where a method fails, and how far its remedy holds.

    `fails_at` and `holds_at` are the two ends of the last bracket, in `unit`; `fails` says on which
    side of it ("above" or "below").  `remedy_holds_to` is the end of what was tried, or, where
    `remedy_fails_at` is a number, of what the remedy can.  `points` and `remedy_points` are what
    was tried: pairs of the parameter and what is measured, infinite where there was no answer.
    """

    name: str
    title: str
    why: str
    parameter: str
    unit: str
    scale: str
    measured: str
    limit: float
    method: str
    fails: str
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
        """Plain data; pairs as lists, infinite values as None."""
        return {key: _plain(value) for key, value in vars(self).items()}


def _plain(value: Any) -> Any:
    if not isinstance(value, tuple):
        return value
    return [[at, None if measured == float("inf") else measured] for at, measured in value]
