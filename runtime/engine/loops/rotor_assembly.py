"""Assembly of mechanisms of many bodies with rotor inertia if it fails with body inertia.

Steps of least change weighted by body inertia rotate the last links of a long chain most, so that
it folds up; with equal rotors on all hinges it bends as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import LoopClosureError

from ...packing.loops.system_variants import characteristic_length, with_rotors
from ...packing.scene_packing import packed_system
from ..looped_engine import LoopedEngine
from .assembly import Assembly

#: Minimum number of speeds: smaller mechanisms do not fold up.
_MIN_SPEEDS = 20
#: Random change (rad, m) of a pose with all links in line.
_RANDOM_CHANGE = 1e-3


class RotorAssembly(Assembly):
    """Assembly that tries again with rotor inertia."""

    def __init__(
        self, engine: LoopedEngine, q: Array, hinges: Collection[str] = (),
        behind: Callable[[Array], str] = lambda q: "", t: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__(engine, q, hinges, behind, t)
        self._engine, self._hinges, self._t = engine, hinges, t

    def positions(self, q: Array, *more: Any, **others: Any) -> Array:
        """See `Assembly.positions`."""
        try:
            return super().positions(q, *more, **others)
        except LoopClosureError as error:
            if self._engine.nu < _MIN_SPEEDS:
                raise
            rotor_assembly = Assembly(self._with_rotors(), q, self._hinges, t=self._t)
            try:
                near_q = rotor_assembly.positions(self._perturbed_positions(q), *more, **others)
            except LoopClosureError:
                raise error from None
            return super().positions(near_q, *more, **others)

    def _perturbed_positions(self, q: Array) -> Array:
        """Perturb q: with all links in line the direction of bending is undetermined."""
        change = _RANDOM_CHANGE * np.random.default_rng(0).uniform(-1.0, 1.0, self._engine.nu)
        return self.calls.move(q, change * self.free_speed_mask)

    def _with_rotors(self) -> LoopedEngine:
        """Engine with a rotor on each hinge: total mass times mean hinge distance squared."""
        packed = self._engine.packed
        system, loop_records = packed.system, packed.written.loops
        masses = system.rows(lambda body: body.body_p[0] if len(body.body_p) else 0.0)
        inertia = (float(masses.sum()) or 1.0) * characteristic_length(system) ** 2
        packed_with_rotors = packed_system(
            with_rotors(system, np.full(self._engine.nu, inertia).tolist()), packed
        )
        assert loop_records is not None and packed_with_rotors.written.loops is not None
        packed_with_rotors.written.loops.copy_pivot_floors(loop_records)
        return LoopedEngine(packed_with_rotors)
