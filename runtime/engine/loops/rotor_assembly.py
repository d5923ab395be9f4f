"""Assembly of mechanisms of many bodies, beside the inertia of rotors where bodies' leads nowhere.

Steps of least change beside the inertia of bodies turn the last links of a long chain most, so that
it crumples; with the same rotors on all hinges it bends as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import OpenLoop

from ...pack.loops.variants import length_of, with_rotors
from ...pack.pack import packed_system
from ..engine import Engine
from .assembly import Assembly

#: Fewer speeds than these do not crumple.
_MANY = 20
#: Motions (rad, m) away from where all is in line.
_ASIDE = 1e-3


class RotorAssembly(Assembly):
    """An `Assembly` that tries again beside rotors."""

    def __init__(
        self, engine: Engine, q: Array, hinges: Collection[str] = (),
        behind: Callable[[Array], str] = lambda q: "", t: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__(engine, q, hinges, behind, t)
        self._engine, self._hinges, self._t = engine, hinges, t

    def positions(self, q: Array, *more: Any, **others: Any) -> Array:
        """See `Assembly.positions`."""
        try:
            return super().positions(q, *more, **others)
        except OpenLoop as error:
            if self._engine.nu < _MANY:
                raise
            beside = Assembly(self._with_rotors(), q, self._hinges, t=self._t)
            try:
                near = beside.positions(self._shaken(q), *more, **others)
            except OpenLoop:
                raise error from None
            return super().positions(near, *more, **others)

    def _shaken(self, q: Array) -> Array:
        """q a little aside: where all is in line nothing tells which way to bend."""
        aside = _ASIDE * np.random.default_rng(0).uniform(-1.0, 1.0, self._engine.nu)
        return self.calls.moved(q, aside * self.free)

    def _with_rotors(self) -> Engine:
        """Each as heavy as all rigid bodies, at the usual distance between hinges."""
        packed = self._engine.packed
        system, known = packed.system, packed.written.loops
        masses = system.rows(lambda body: body.body_p[0] if len(body.body_p) else 0.0)
        inertia = (float(masses.sum()) or 1.0) * length_of(system) ** 2
        heavy = packed_system(
            with_rotors(system, np.full(self._engine.nu, inertia).tolist()), packed
        )
        assert known is not None and heavy.written.loops is not None
        heavy.written.loops.judge_as(known)
        return Engine(heavy)
