"""States of a run at its samples, and the methods that computed them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.plain_data import stored_as
from mstmm.risk import Risk

from ..integrate.achieved_error import AchievedError
from ..integrate.c_loop import Statistics, Status
from ..integrate.settings import Settings


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


@dataclass(frozen=True)
class Trajectory:
    """States of a run: t (n,), q (n, nq), u (n, nu), memory (n, m), work (n,) in J, event (n,).

    q and u hold unit quaternions and exact driven coordinates; `norm_residual` is the largest
    deviation of a quaternion's length from 1 before normalisation.  `last_state` is (t, q, u) of
    the last good state and `start` is (q, u) at t_start; output times may omit both.
    """

    t: Array
    q: Array
    u: Array
    memory: Array
    work: Array
    event: NDArray[np.int64]
    status: Status | None  # None: interrupted
    message: str
    settings: Settings
    statistics: Statistics
    fail_time: float | None = None
    notes: tuple[str, ...] = field(default=())
    norm_residual: float = 0.0
    last_state: tuple[float, Array, Array] | None = None
    start: tuple[Array, Array] | None = None
    risks: Iterable[Risk] = ()  # found before and during the run, not from its samples
    methods: tuple[MethodSegment, ...] = ()  # of method "auto"
    achieved_error: AchievedError | None = None  # of a run with a target error
    reported_risks: bool = True  # whether its risks appear among its warnings
    earlier_seconds: float = (
        0.0  # wall time in s of earlier processes; result files do not store it
    )

    @property
    def first(self) -> tuple[float, Array, Array]:
        """(t, q, u) at the start; of the first sample in an old file without the start."""
        if self.start is not None:
            return (self.settings.t_start, *self.start)
        if not len(self.t):
            raise SceneError("result file: expected the initial state or a sample, found neither")
        return float(self.t[0]), self.q[0], self.u[0]

    @property
    def success(self) -> bool:
        """True if the run reached t_end or a stop event, with finite numbers."""
        return self.is_comparable and self.status is not Status.CAME_TO_REST

    @property
    def is_comparable(self) -> bool:
        """True if the numbers are finite up to t_end, a stop event, or the rest of a bounce."""
        is_complete = self.status in (Status.FINISHED, Status.STOPPED, Status.CAME_TO_REST)
        return is_complete and bool(np.isfinite(self.q).all() and np.isfinite(self.u).all())
