"""Segments of a run of method "auto", each computed by one method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from mstmm.plain_data import stored_as


@dataclass(frozen=True)
class MethodSegment:
    """Part of a run that one method computed.

    Attributes:
        t: start of the segment, s.
        method: name of the method.
        fastest_rate: |lambda| of the fastest motion of laws and modes at t, 1/s; None if not
            computed.
        reason: reason for the method.
    """

    t: float
    method: str
    fastest_rate: float | None = field(metadata=stored_as("rate"))
    reason: str = field(metadata=stored_as("why"))

    def __str__(self) -> str:
        motion = (
            "" if self.fastest_rate is None else f", fastest motion {self.fastest_rate:.3g} 1/s"
        )
        return f"{self.method} from t = {self.t:.6g} s ({self.reason}{motion})"


def from_rows(rows: Sequence[dict[str, Any]]) -> tuple[MethodSegment, ...]:
    """Segments from a list of dictionaries; TypeError or KeyError for invalid ones."""
    segments = []
    for row in rows:
        t, rate = row["t"], row["rate"]
        if not all(isinstance(x, (int, float)) for x in (t, 0.0 if rate is None else rate)):
            raise TypeError(f"method segment: expected numbers t and rate, found {row!r}")
        segments.append(MethodSegment(float(t), str(row["method"]), rate, str(row["why"])))
    return tuple(segments)
