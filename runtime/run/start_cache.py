"""Where several runs of one scene begin: what they share is made for the first of them."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Integrator
from ..integrate.settings import Settings
from .integration_run import asks_positions, energy_at, initial_method, make_run, tolerances
from .scene_system import SceneCode, SceneSystem

#: Runs of more components are long enough for all to be made anew.
_MOST = 200


class StartCache:
    """Runs of one engine over the same times with the same samples, one after the other: the
    integrator of one stands at the start of the next, while the code is the same.
    """

    def __init__(self) -> None:
        self._made: tuple[SceneSystem, Integrator] | None = None
        #: Time (s), state and energy (J) of a start.
        self._known: tuple[float, Array, float] | None = None

    def begin(
        self,
        engine: LoopedEngine,
        compiled: SceneCode | None,
        settings: Settings,
        q: Array,
        u: Array,
    ) -> tuple[SceneSystem, Integrator]:
        """The system and the integrator at the start of a run from (nq,), (nu,)."""
        if self._made is None or not self._serves(self._made[0], compiled, settings):
            system = SceneSystem(engine, compiled)
            run = make_run(system, settings, q, u, energy=self._energy_at)
            self._made = system, run
            return system, run
        system, run = self._made
        tableau = initial_method(system, settings)
        system.memory[:] = engine.start_memory()
        start = system.begin(settings.t_start, q, u)
        run.begin(tableau, settings, start, tolerances(system, settings, start, self._energy_at))
        return system, run

    @staticmethod
    def _serves(system: SceneSystem, compiled: SceneCode | None, settings: Settings) -> bool:
        return system.goes_by(compiled) and system.on_positions == asks_positions(settings)

    def _energy_at(self, system: SceneSystem, t: float, start: Array) -> float:
        """That of the start, J, looked at once for runs from the same."""
        known = self._known
        if known is None or known[0] != t or not np.array_equal(known[1], start):
            known = self._known = t, start.copy(), energy_at(system, t, start)
        return known[2]


#: The integrator of a model's last run, and over which times with which samples.
_waiting: WeakKeyDictionary[CompiledScene, tuple[object, StartCache]] = WeakKeyDictionary()


def take_start_cache(model: CompiledScene, settings: Settings) -> StartCache:
    """Beginnings of a run: of the model's last one where that was over the same times with the same
    samples.  Of several threads one gets it."""
    times, found = _waiting.pop(model, (None, None))
    return StartCache() if found is None or times != _times(settings) else found


def return_start_cache(model: CompiledScene, settings: Settings, beginnings: StartCache) -> None:
    """Keep those of a run that has ended for the next one."""
    if model.nq + model.nu <= _MOST:
        _waiting[model] = _times(settings), beginnings


def _times(settings: Settings) -> object:
    return settings.t_start, settings.t_end, settings.output_times
