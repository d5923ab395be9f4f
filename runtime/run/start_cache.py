"""Cache of integrators that successive runs of one scene reuse."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np

from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Integrator
from ..integrate.settings import Settings
from .integration_run import (
    energy_at,
    initial_method,
    make_run,
    tolerances,
    uses_position_constraints,
)
from .scene_system import SceneCode, SceneSystem

#: Largest number of state components; runs of more take so long that reuse saves nothing.
_MAX_STATES = 200


class StartCache:
    """System and integrator for successive runs of one engine over the same times.

    They are reused while the fused code and the constraint level of the method are the same.
    """

    def __init__(self) -> None:
        self._cached: tuple[SceneSystem, Integrator] | None = None
        #: Time (s), state and energy (J) of the last start.
        self._start_energy: tuple[float, Array, float] | None = None

    def begin(
        self,
        engine: LoopedEngine,
        compiled: SceneCode | None,
        settings: Settings,
        q: Array,
        u: Array,
    ) -> tuple[SceneSystem, Integrator]:
        """System and integrator at the start of a run from (nq,), (nu,)."""
        if self._cached is None or not self._is_reusable(self._cached[0], compiled, settings):
            system = SceneSystem(engine, compiled)
            run = make_run(system, settings, q, u, energy=self._energy_at)
            self._cached = system, run
            return system, run
        system, run = self._cached
        tableau = initial_method(system, settings)
        system.memory[:] = engine.start_memory()
        start = system.begin(settings.t_start, q, u)
        run.start(tableau, settings, start, tolerances(system, settings, start, self._energy_at))
        return system, run

    @staticmethod
    def _is_reusable(system: SceneSystem, compiled: SceneCode | None, settings: Settings) -> bool:
        same_level = system.uses_position_level == uses_position_constraints(settings)
        return system.uses_code(compiled) and same_level

    def _energy_at(self, system: SceneSystem, t: float, start: Array) -> float:
        """Energy of the start in J, computed once for runs from the same start."""
        cached = self._start_energy
        if cached is None or cached[0] != t or not np.array_equal(cached[1], start):
            cached = self._start_energy = t, start.copy(), energy_at(system, t, start)
        return cached[2]


#: Start cache of a model's last run, with the times for which it is valid.
_last_caches: WeakKeyDictionary[CompiledScene, tuple[object, StartCache]] = WeakKeyDictionary()


def take_start_cache(model: CompiledScene, settings: Settings) -> StartCache:
    """Take the start cache of the model's last run if its times are the same, else a new one.

    Taking removes it, so that only one of several threads uses it.
    """
    times, cache = _last_caches.pop(model, (None, None))
    return StartCache() if cache is None or times != _times(settings) else cache


def return_start_cache(model: CompiledScene, settings: Settings, beginnings: StartCache) -> None:
    """Return the start cache of a finished run, for the model's next run."""
    if model.nq + model.nu <= _MAX_STATES:
        _last_caches[model] = _times(settings), beginnings


def _times(settings: Settings) -> object:
    return settings.t_start, settings.t_end, settings.output_times
