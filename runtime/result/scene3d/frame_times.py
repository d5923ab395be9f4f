"""Frame times of a film of a run, and interpolation between its samples."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, finite_float
from mstmm.errors import SceneError

from ..observations import quaternions
from .scene_graph import Poses

if TYPE_CHECKING:
    from ..result_record import Record

#: Frames per second, and least and largest duration of a film (s).
FRAME_RATE, MIN_DURATION, MAX_DURATION = 30.0, 1.5, 20.0
#: Largest number of poses in a film; beyond, it has fewer frames.
_MAX_POSES = 90_000
_MIN_FRAMES = 24
#: Points of a trail from one frame to the next.
_TRAIL_POINTS_PER_FRAME = 4
_SPEED_EXPECTATION = "seconds of the run per second of film, above 0"


@dataclass(frozen=True)
class FrameTimes:
    """Frame times of a film of a run.

    Attributes:
        samples: samples of the run that can be drawn; two at the same time are those before and
            after an event.
        t: (n,) s, their times.
        times: (f,) s, the frame times.
        speed: seconds of the run per second of film.
    """

    samples: NDArray[np.int64]
    t: Array
    times: Array
    speed: float

    @classmethod
    def for_run(
        cls, run: Record, owners: int, speed: float | None, most: int | None = None
    ) -> FrameTimes:
        """Frame times for a scene with `owners` bodies and hinges.

        `speed` defaults to 1, or, for short and long runs, is chosen for a film of some seconds.
        SceneError for a run without samples.
        """
        finite = np.flatnonzero(np.isfinite(run.q).all(axis=1))
        if not len(finite):
            raise SceneError("nothing to draw: the run has no sample with finite coordinates")
        finite_samples, t = finite, run.t[finite]
        duration = float(t[-1] - t[0])
        if duration == 0:
            return cls(finite_samples[-1:], t[-1:], t[-1:], 1.0)
        speed = (
            natural_speed(duration)
            if speed is None
            else finite_float("speed", speed, _SPEED_EXPECTATION)
        )
        if speed <= 0:
            raise SceneError(f"speed = {speed:g}: expected {_SPEED_EXPECTATION}")
        count = math.ceil(duration / speed * FRAME_RATE) + 1
        count = max(2, min(count, most or count, max(_MIN_FRAMES, _MAX_POSES // max(1, owners))))
        return cls(finite_samples, t, np.linspace(t[0], t[-1], count), speed)

    @cached_property
    def _exact(self) -> bool:
        return len(self.times) == len(self.t) and bool(np.array_equal(self.times, self.t))

    def interpolate_hermite(self, values: Array, rates: Array) -> Array:
        """Values (n, ...) with their time rates at the frame times, by cubic Hermite pieces."""
        if self._exact:
            return values
        from scipy.interpolate import CubicHermiteSpline

        def interpolate(part: slice, at: Array) -> Array:
            return np.asarray(CubicHermiteSpline(self.t[part], values[part], rates[part])(at))

        return self._pieces(values, interpolate)

    def interpolate_linear(self, values: Array) -> Array:
        """Values (n, k) at the frame times, interpolated linearly between samples."""

        def interpolate(part: slice, at: Array) -> Array:
            columns = [np.interp(at, self.t[part], column) for column in values[part].T]
            return np.array(columns).reshape(len(columns), len(at)).T

        return self._pieces(values, interpolate)

    def interpolate_rotation(self, quaternions: Array) -> Array:
        """Quaternions (n, 4), w first, at the frame times, at constant rates between samples."""
        from scipy.spatial.transform import Rotation, Slerp

        def interpolate(part: slice, at: Array) -> Array:
            turns = Rotation.from_quat(quaternions[part][:, [1, 2, 3, 0]])
            found: Array = Slerp(self.t[part], turns)(at).as_quat()[:, [3, 0, 1, 2]]
            return found

        return self._pieces(quaternions, interpolate)

    def _pieces(self, values: Array, between: Callable[[slice, Array], Array]) -> Array:
        """Apply `between` to each stretch of samples without an event.

        At the time of an event the value after it is used.
        """
        if len(self.t) == 1:
            return np.repeat(values[:1], len(self.times), axis=0)
        result = np.empty((len(self.times), *values.shape[1:]))
        bounds = [0, *(np.flatnonzero(np.diff(self.t) <= 0) + 1), len(self.t)]
        for first, end_index in pairwise(bounds):
            inside = (self.times >= self.t[first]) & (self.times <= self.t[end_index - 1])
            part = slice(first, end_index)
            if end_index - first == 1:
                result[inside] = values[first]
            elif inside.any():
                result[inside] = between(part, self.times[inside])
        return result

    def path(self, run: Record, reference: str) -> Array:
        """Path (n, 3) in m of a body's origin or an end, in finer time steps than the frames."""
        point_count = _TRAIL_POINTS_PER_FRAME * (len(self.times) - 1) + 1
        trail_times = replace(self, times=np.linspace(self.times[0], self.times[-1], point_count))
        points = run._observations.points(reference)[self.samples]
        return trail_times.interpolate_hermite(points[:, 0:3], points[:, 3:6])

    def poses(self, run: Record, reference: str) -> Poses:
        """Poses of the axes of a body or an end."""
        points = run._observations.points(reference)[self.samples]
        position = self.interpolate_hermite(points[:, 0:3], points[:, 3:6])
        orientation = quaternions(points[:, 15:24])
        return Poses(
            position, orientation if self._exact else self.interpolate_rotation(orientation)
        )


def natural_speed(lasts: float) -> float:
    """Default speed: 1, or 1, 2 or 5 times a power of ten, for a film of some seconds."""
    if MIN_DURATION <= lasts <= MAX_DURATION:
        return 1.0
    target_speed = lasts / (4 * MIN_DURATION if lasts < MIN_DURATION else MAX_DURATION / 2)
    power = 10.0 ** math.floor(math.log10(target_speed))
    steps = (1, 2, 5, 10)
    return power * min(steps, key=lambda step: abs(math.log(step * power / target_speed)))
