"""Which methods made a run, where the run itself chose among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class MethodSegment:
    """A part of a run that one method made.

    Attributes:
        t: where it begins, s.
        method: its name.
        rate: |lambda| of the fastest motion of laws and modes there, 1/s; None if nobody asked.
        why: in words.
    """

    t: float
    method: str
    rate: float | None
    why: str

    def __str__(self) -> str:
        motion = "" if self.rate is None else f", fastest motion {self.rate:.3g} 1/s"
        return f"{self.method} from t = {self.t:.6g} s ({self.why}{motion})"


def from_rows(rows: Sequence[dict[str, Any]]) -> tuple[MethodSegment, ...]:
    """Stretches from plain data.  TypeError or KeyError where that is something else."""
    found = []
    for row in rows:
        t, rate = row["t"], row["rate"]
        if not all(isinstance(x, (int, float)) for x in (t, 0.0 if rate is None else rate)):
            raise TypeError(f"{row!r} is no part of a run")
        found.append(MethodSegment(float(t), str(row["method"]), rate, str(row["why"])))
    return tuple(found)
