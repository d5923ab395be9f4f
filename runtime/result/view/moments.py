"""When a run is looked at, and where everything is in between its samples."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array, real
from mstmm.errors import SceneError

from ..observed import quaternions
from .stage import Poses

if TYPE_CHECKING:
    from ..record import Record

#: Pictures a second, and how long a film should be at least and at most (s).
RATE, SHORTEST, LONGEST = 30.0, 1.5, 20.0
#: Places of owners that a film may hold; beyond them it has fewer pictures.
_MOST = 90_000
_FEWEST = 24
#: Places of a trail from one picture to the next.
_FINER = 4
_SPEED = "seconds of the run that pass in one second, above 0"


@dataclass(frozen=True)
class Moments:
    """The moments of a film of a run.

    Attributes:
        kept: samples of the run that can be drawn, no two at the same time.
        t: (n,) s, their times.
        times: (f,) s, the moments.
        speed: seconds of the run per second of film.
    """

    kept: NDArray[np.int64]
    t: Array
    times: Array
    speed: float

    @classmethod
    def of(cls, run: Record, owners: int, speed: float | None, most: int | None = None) -> Moments:
        """Moments for a scene of so many bodies and hinges.

        `speed` by itself is 1, or for short and long runs what gives a film of some seconds.
        SceneError for a run without a sample.
        """
        finite = np.flatnonzero(np.isfinite(run.q).all(axis=1))
        if not len(finite):
            raise SceneError("there is nothing to look at: the run has no sample with numbers")
        t = run.t[finite]
        last = np.append(np.diff(t) > 0, True)  # of an event's two samples the one behind it
        kept, t = finite[last], t[last]
        lasts = float(t[-1] - t[0])
        if lasts == 0:
            return cls(kept[-1:], t[-1:], t[-1:], 1.0)
        speed = natural_speed(lasts) if speed is None else real("speed", speed, _SPEED)
        if speed <= 0:
            raise SceneError(f"speed = {speed:g}: expected {_SPEED}")
        count = math.ceil(lasts / speed * RATE) + 1
        count = max(2, min(count, most or count, max(_FEWEST, _MOST // max(1, owners))))
        return cls(kept, t, np.linspace(t[0], t[-1], count), speed)

    @cached_property
    def _exact(self) -> bool:
        return len(self.times) == len(self.t) and bool(np.array_equal(self.times, self.t))

    def smooth(self, values: Array, rates: Array) -> Array:
        """Values (n, ...) with their time rates at the moments, by cubic Hermite pieces."""
        if self._exact:
            return values
        from scipy.interpolate import CubicHermiteSpline

        return np.asarray(CubicHermiteSpline(self.t, values, rates)(self.times))

    def way(self, run: Record, reference: str) -> Array:
        """(n, 3) m, the way of a body's origin or an end, in steps of time finer than a film's."""
        finer = replace(self, times=np.linspace(self.times[0], self.times[-1], self._fine))
        points = run._observed.points(reference)[self.kept]
        return finer.smooth(points[:, 0:3], points[:, 3:6])

    @property
    def _fine(self) -> int:
        return _FINER * (len(self.times) - 1) + 1

    def poses(self, run: Record, reference: str) -> Poses:
        """The axes of a body or an end."""
        points = run._observed.points(reference)[self.kept]
        position = self.smooth(points[:, 0:3], points[:, 3:6])
        turned = quaternions(points[:, 15:24])
        if not self._exact:
            from scipy.spatial.transform import Rotation, Slerp

            between = Slerp(self.t, Rotation.from_quat(turned[:, [1, 2, 3, 0]]))(self.times)
            turned = between.as_quat()[:, [3, 0, 1, 2]]
        return Poses(position, turned)


def natural_speed(lasts: float) -> float:
    """1, or 1, 2 or 5 times a power of ten so that a film lasts some seconds."""
    if SHORTEST <= lasts <= LONGEST:
        return 1.0
    wanted = lasts / (4 * SHORTEST if lasts < SHORTEST else LONGEST / 2)
    power = 10.0 ** math.floor(math.log10(wanted))
    steps = (1, 2, 5, 10)
    return power * min(steps, key=lambda step: abs(math.log(step * power / wanted)))
