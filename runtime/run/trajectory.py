"""States of a run at its samples."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import Risk

from ..integrate.achieved_error import AchievedError
from ..integrate.c_loop import Statistics, Status
from ..integrate.settings import Settings
from .method_segments import MethodSegment


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
