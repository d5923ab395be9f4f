"""When a run is looked at, and where everything is in between its samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
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
        kept: samples of the run that can be drawn; two at the same time stand before and behind an
            event.
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
        kept, t = finite, run.t[finite]
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

        def between(part: slice, at: Array) -> Array:
            return np.asarray(CubicHermiteSpline(self.t[part], values[part], rates[part])(at))

        return self._pieces(values, between)

    def straight(self, values: Array) -> Array:
        """Values (n, k) at the moments, straight between samples."""

        def between(part: slice, at: Array) -> Array:
            columns = [np.interp(at, self.t[part], column) for column in values[part].T]
            return np.array(columns).reshape(len(columns), len(at)).T

        return self._pieces(values, between)

    def turned(self, quaternions: Array) -> Array:
        """Quaternions (n, 4) at the moments, w first, at even rates between samples."""
        from scipy.spatial.transform import Rotation, Slerp

        def between(part: slice, at: Array) -> Array:
            turns = Rotation.from_quat(quaternions[part][:, [1, 2, 3, 0]])
            found: Array = Slerp(self.t[part], turns)(at).as_quat()[:, [3, 0, 1, 2]]
            return found

        return self._pieces(quaternions, between)

    def _pieces(self, values: Array, between: Callable[[slice, Array], Array]) -> Array:
        """`between` on each stretch of samples without an event; what an event changes at one time
        is what it is behind it."""
        if len(self.t) == 1:
            return np.repeat(values[:1], len(self.times), axis=0)
        found = np.empty((len(self.times), *values.shape[1:]))
        bounds = [0, *(np.flatnonzero(np.diff(self.t) <= 0) + 1), len(self.t)]
        for first, behind in pairwise(bounds):
            inside = (self.times >= self.t[first]) & (self.times <= self.t[behind - 1])
            part = slice(first, behind)
            if behind - first == 1:
                found[inside] = values[first]
            elif inside.any():
                found[inside] = between(part, self.times[inside])
        return found

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
        return Poses(position, turned if self._exact else self.turned(turned))


def natural_speed(lasts: float) -> float:
    """1, or 1, 2 or 5 times a power of ten so that a film lasts some seconds."""
    if SHORTEST <= lasts <= LONGEST:
        return 1.0
    wanted = lasts / (4 * SHORTEST if lasts < SHORTEST else LONGEST / 2)
    power = 10.0 ** math.floor(math.log10(wanted))
    steps = (1, 2, 5, 10)
    return power * min(steps, key=lambda step: abs(math.log(step * power / wanted)))
