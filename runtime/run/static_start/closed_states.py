"""A mechanism at one moment: its closed states, and small motions from one to the next."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ...engine.characteristic_scales import speed_scales
from ...engine.loops.independent_speeds import IndependentSpeeds
from ..scene_system import SceneSystem

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Loops are followed in steps no longer than this, in sizes: longer ones may end where they are
#: closed another way.
_PART = 0.1
#: Drift (m, rad) of what is to stay that is rounding, and most returns to its place.
_STAYS, _RETURNS = 1e-13, 20


class ClosedStates:
    """The closed states of a model at time t, `freedom` being its motions."""

    def __init__(self, model: CompiledScene, freedom: IndependentSpeeds, t: float) -> None:
        self.engine, self.freedom, self.t = model.looped, freedom, t
        self.layout, self.sizes = model.layout, speed_scales(model)
        self.memory = model.looped.start_memory()
        self._scene = SceneSystem(model.looped, with_power=False)
        self._still = np.zeros(model.nu)

    def state(self, q: Array, u: Array | None = None) -> tuple[Array, Array]:
        """(q, u) nearby with loops closed and without slips; from rest if no u is given."""
        try:
            y = self._scene.start(self.t, q, self._still if u is None else u)
        except SceneError as error:
            raise NumericalFailure(str(error)) from None
        return y[: self.engine.nq], y[self.engine.nq :]

    def accelerations(self, q: Array, u: Array, places: Sequence[int], follows: Array) -> Array:
        """Those that loops and drives ask for (nu,) where some independent speeds have none."""
        one = np.array([self.t]), q[None], u[None], self.memory[None]
        found = self.engine.accelerations(*one)[1][0]
        return np.asarray(found - follows @ found[list(places)])

    def moved(self, q: Array, places: Sequence[int], motion: Array) -> Array:
        """q after a motion of independent speeds, loops closed again."""
        longest = float(np.abs(motion / self.sizes[list(places)]).max(initial=0.0))
        parts = max(1, int(np.ceil(longest / _PART)))
        for _ in range(parts):
            q = self._moved(q, places, motion / parts)
        return q

    def moved_beside(self, q: Array, places: Sequence[int], motion: Array, held: int) -> Array:
        """The same, and the first `held` of these speeds have led nowhere else."""
        start = q
        q = self.moved(q, places, motion)
        for _ in range(_RETURNS):
            drift = np.zeros(len(places))
            drift[:held] = self._apart(start, q, places[:held])
            if not np.abs(drift).max(initial=0.0) > _STAYS:
                break
            q = self._moved(q, places, drift)
        return q

    def _moved(self, q: Array, places: Sequence[int], motion: Array) -> Array:
        follows = self.freedom.following(q, places)
        return self.state(self.freedom.moved(q, follows @ motion))[0]

    def _apart(self, wanted: Array, q: Array, places: Sequence[int]) -> Array:
        """The motion along some speeds that leads from q to what is wanted of these."""
        motion = np.zeros(len(self.sizes))
        slots = {one.u: one for one in map(self.layout.hinge_of_speed, places)}
        for one in slots.values():
            missing = (wanted - q)[one.q_slice]
            if not one.straight:
                speeds = np.eye(len(motion))[one.u_slice]
                rates = [self.engine.rates(self.t, q, speed, self.memory) for speed in speeds]
                ways = np.array(rates)[:, one.q_slice].T
                missing = np.asarray(np.linalg.lstsq(ways, missing, rcond=None)[0])
            motion[one.u_slice] = missing
        return motion[list(places)]
