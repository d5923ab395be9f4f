"""The states of a run over its samples."""

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

    q and u hold unit quaternions and exact driven coordinates; `norm_residual` is how far the
    quaternions' lengths were from 1 before.  `last` is (t, q, u) of the last good state and `start`
    (q, u) at the beginning, which output times may leave out.
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
    last: tuple[float, Array, Array] | None = None
    start: tuple[Array, Array] | None = None
    risks: Iterable[Risk] = ()  # seen before the run and by it, which samples do not tell
    methods: tuple[MethodSegment, ...] = ()  # of a run that chose among them
    reached: AchievedError | None = None  # of a run that was asked for an error
    told: bool = True  # whether its risks are wanted among its warnings
    before: float = 0.0  # s of wall time that earlier processes spent on it, which no file keeps

    @property
    def first(self) -> tuple[float, Array, Array]:
        """(t, q, u) of the beginning; of the first sample where an older file knows no other."""
        if self.start is not None:
            return (self.settings.t_start, *self.start)
        if not len(self.t):
            raise SceneError("the file of this result does not tell how its run began")
        return float(self.t[0]), self.q[0], self.u[0]

    @property
    def success(self) -> bool:
        """True if the run reached its end or an event was asked to stop it, with finite numbers."""
        return self.is_comparable and self.status is not Status.CAME_TO_REST

    @property
    def is_comparable(self) -> bool:
        """True if the run has finite numbers up to where it is defined: to its end, to an event
        that was asked to stop it, or to where bounces came to rest."""
        done = self.status in (Status.FINISHED, Status.STOPPED, Status.CAME_TO_REST)
        return done and bool(np.isfinite(self.q).all() and np.isfinite(self.u).all())
