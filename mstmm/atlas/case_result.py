"""Result of a case of the atlas, as data."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..plain_data import stored_as, stored_keys
from .frontier import Points


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
