"""Closed states of a mechanism at one time, and motions from one closed state to another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ...engine.compiled_scene import speed_scales
from ...engine.loops.independent_speeds import IndependentSpeeds
from ..scene_system import SceneSystem

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Longest step of a motion relative to the characteristic scales: after a longer one the loops may
#: close in another configuration.
_MAX_STEP = 0.1
#: Drift (m, rad) of fixed coordinates that counts as rounding, and largest number of corrections.
_MAX_DRIFT, _MAX_CORRECTIONS = 1e-13, 20


class ClosedStates:
    """Closed states of a model at time t (s); `freedom` gives its independent speeds."""

    def __init__(self, model: CompiledScene, freedom: IndependentSpeeds, t: float) -> None:
        self.engine, self.freedom, self.t = model.looped, freedom, t
        self.layout, self.sizes = model.coordinate_layout, speed_scales(model)
        self.memory = model.looped.start_memory()
        self._scene = SceneSystem(model.looped, with_power=False)
        self._zero_speeds = np.zeros(model.nu)

    def state(self, q: Array, u: Array | None = None) -> tuple[Array, Array]:
        """Nearby state (q, u) that satisfies all constraints; u = 0 before projection by default.

        Raises NumericalFailure where the loops do not close.
        """
        try:
            y = self._scene.start(self.t, q, self._zero_speeds if u is None else u)
        except SceneError as error:
            raise NumericalFailure(str(error)) from None
        return y[: self.engine.nq], y[self.engine.nq :]

    def accelerations(self, q: Array, u: Array, places: Sequence[int], follows: Array) -> Array:
        """Accelerations (nu,) due to loops and drives with zero ones of the speeds `places`.

        `follows` (nu, k) gives all speeds from these k independent ones.
        """
        state = np.array([self.t]), q[None], u[None], self.memory[None]
        udot = self.engine.accelerations(*state)[1][0]
        return np.asarray(udot - follows @ udot[list(places)])

    def move(self, q: Array, places: Sequence[int], motion: Array) -> Array:
        """q after a motion of the independent speeds `places`, with all loops closed."""
        length = float(np.abs(motion / self.sizes[list(places)]).max(initial=0.0))
        step_count = max(1, int(np.ceil(length / _MAX_STEP)))
        for _ in range(step_count):
            q = self._step(q, places, motion / step_count)
        return q

    def move_with_fixed(self, q: Array, places: Sequence[int], motion: Array, held: int) -> Array:
        """q after a motion that leaves the coordinates of the first `held` speeds unchanged."""
        start = q
        q = self.move(q, places, motion)
        for _ in range(_MAX_CORRECTIONS):
            drift = np.zeros(len(places))
            drift[:held] = self._motion_to(start, q, places[:held])
            if not np.abs(drift).max(initial=0.0) > _MAX_DRIFT:
                break
            q = self._step(q, places, drift)
        return q

    def _step(self, q: Array, places: Sequence[int], motion: Array) -> Array:
        follows = self.freedom.motion_matrix(q, places)
        return self.state(self.freedom.move(q, follows @ motion))[0]

    def _motion_to(self, target: Array, q: Array, places: Sequence[int]) -> Array:
        """Motion along the speeds `places` that moves their coordinates from q to `target`."""
        motion = np.zeros(len(self.sizes))
        slots_by_speed = {slots.u: slots for slots in map(self.layout.hinge_of_speed, places)}
        for slots in slots_by_speed.values():
            gap = (target - q)[slots.q_slice]
            if not slots.rates_are_speeds:
                speeds = np.eye(len(motion))[slots.u_slice]
                rates = [self.engine.rates(self.t, q, speed, self.memory) for speed in speeds]
                rate_matrix = np.array(rates)[:, slots.q_slice].T
                gap = np.asarray(np.linalg.lstsq(rate_matrix, gap, rcond=None)[0])
            motion[slots.u_slice] = gap
        return motion[list(places)]
