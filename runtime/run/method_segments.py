"""Segments of a run of method "auto", each computed by one method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class MethodSegment:
    """Part of a run that one method computed.

    Attributes:
        t: start of the segment, s.
        method: name of the method.
        rate: |lambda| of the fastest motion of laws and modes at t, 1/s; None if not computed.
        why: reason for the method.
    """

    t: float
    method: str
    rate: float | None
    why: str

    def __str__(self) -> str:
        motion = "" if self.rate is None else f", fastest motion {self.rate:.3g} 1/s"
        return f"{self.method} from t = {self.t:.6g} s ({self.why}{motion})"


def from_rows(rows: Sequence[dict[str, Any]]) -> tuple[MethodSegment, ...]:
    """Segments from a list of dictionaries; TypeError or KeyError for invalid ones."""
    segments = []
    for row in rows:
        t, rate = row["t"], row["rate"]
        if not all(isinstance(x, (int, float)) for x in (t, 0.0 if rate is None else rate)):
            raise TypeError(f"method segment: expected numbers t and rate, found {row!r}")
        segments.append(MethodSegment(float(t), str(row["method"]), rate, str(row["why"])))
    return tuple(segments)
