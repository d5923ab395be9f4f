"""Where several runs of one scene begin: what they share is made for the first of them."""

from __future__ import annotations

from mstmm.arrays import Array

from ..engine.engine import Engine
from ..integrate.loop import Run
from ..integrate.settings import Settings
from .simulate import energy_at, make_run, suited, tolerances
from .system import SceneCode, SceneSystem


class Beginnings:
    """Runs of one engine from one state over the same times with the same samples, one after the
    other: the integrator of one stands at the start of the next.  On compiled code each is made
    anew.
    """

    def __init__(self) -> None:
        self._made: tuple[SceneSystem, Run] | None = None
        self._energy: float | None = None

    def begin(
        self, engine: Engine, compiled: SceneCode | None, settings: Settings, q: Array, u: Array
    ) -> tuple[SceneSystem, Run]:
        """The system and the integrator at the start of a run from (nq,), (nu,)."""
        if compiled is not None or self._made is None:
            system = SceneSystem(engine, compiled)
            run = make_run(system, settings, q, u, energy=self._energy_at)
            self._made = self._made if compiled is not None else (system, run)
            return system, run
        system, run = self._made
        tableau = suited(system, settings)
        system.memory[:] = engine.start_memory()
        start = system.begin(settings.t_start, q, u)
        run.begin(tableau, settings, start, tolerances(system, settings, start, self._energy_at))
        return system, run

    def _energy_at(self, system: SceneSystem, t: float, start: Array) -> float:
        """That of the start, J, looked at once."""
        if self._energy is None:
            self._energy = energy_at(system, t, start)
        return self._energy
