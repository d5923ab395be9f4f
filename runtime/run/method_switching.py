"""`method = "auto"`: an explicit method, and an implicit one where stability sets its steps.

A run starts by dop853.  What its steps say of stability costs nothing; when most of the last ones
were as long as it allows, the fastest motion that laws and modes cause is estimated.  If that is
what holds the steps back, and fast against the whole run, the run goes on by a Rosenbrock method,
and back once the steps of that one would be stable for an explicit method as well.  A run that is
not stiff has the numbers of dop853, to the last bit.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict

from mstmm.errors import NumericalFailure, SceneError

from ..integrate.c_loop import Integrator
from ..integrate.settings import Settings
from ..integrate.steppers import AUTO_EXPLICIT, get
from ..packing.qr_sweep import reject_qr_steps
from .method_segments import MethodSegment, from_rows
from .scene_system import SceneSystem
from .spectral_radius import FastestMode

#: Of the last steps so many have to speak for a change: to an implicit method, and back.
_STIFF, _NOT_STIFF = 5, 10

#: h |lambda| up to which a step of an explicit method is stable.
_STABLE = 2.5

#: |lambda| times the time of a run up to which an explicit method costs less whatever limits it.
_FEW = 2000.0

#: Tolerances from this on are met at less cost by the method of lower order.
_LOOSE = 1e-5


def implicit_method(rtol: float) -> str:
    """Which implicit method `auto` takes for a tolerance."""
    return "rodas4p2" if rtol >= _LOOSE else "rodas5p"


class Choice:
    """The choice of method within one run; `look` between its slices."""

    def __init__(self, system: SceneSystem, settings: Settings, run: Integrator) -> None:
        self._system, self._settings = system, settings
        self._fastest: FastestMode | None = None
        self._asked_for = (_STIFF, 0, 0.0)
        self._since = 0  # steps of the run before the present method
        self.stretches = [
            MethodSegment(settings.t_start, AUTO_EXPLICIT, None, "every run starts so")
        ]
        run.call_back(*self._asked_for)

    def look(self, run: Integrator) -> None:
        """Change the method if the run asked for a look and its steps say so."""
        rate = self._rate(run) if run.asked else None
        if rate is None:
            return
        if run.tableau.implicit:
            self._look_back(run, rate)
        elif self._is_stiff(run, rate):
            self._change(run, implicit_method(self._settings.rtol), rate)
        else:
            self._ask(run, 2 * self._asked_for[0])

    def rescue(self, run: Integrator) -> bool:
        """Let a run that failed for want of an implicit step go on explicitly, to its end.

        Returns whether it does.
        """
        if not (run.tableau.implicit and run.no_step):
            return False
        why = f"{run.tableau.name} finds no step"
        run.change(get(AUTO_EXPLICIT))
        self.stretches.append(MethodSegment(run.t, AUTO_EXPLICIT, None, why))
        self._ask(run, 0)
        return True

    def _rate(self, run: Integrator) -> float | None:
        """|lambda| where the run stands, 0 where it cannot be computed, which the run will say.
        None, and no further questions, for scenes without implicit methods."""
        system, engine = self._system, self._system.engine
        if self._fastest is None:
            try:
                reject_qr_steps(engine.packed)
                self._fastest = FastestMode(engine, system.memory)
            except SceneError as error:
                self.stretches.append(MethodSegment(run.t, AUTO_EXPLICIT, None, f"stays: {error}"))
                self._ask(run, 0)
                return None
        q, u = run.y[: engine.nq], run.y[engine.nq : engine.nq + engine.nu]
        try:
            return self._fastest.rate(run.t, q, u)
        except NumericalFailure:
            return 0.0

    def _is_stiff(self, run: Integrator, rate: float) -> bool:
        span = self._settings.t_end - self._settings.t_start
        return rate * span > _FEW and rate * run.last_step > _STABLE

    def _look_back(self, run: Integrator, rate: float) -> None:
        """After 10, 20, 40, ... implicit steps, or when so many were short for an explicit one."""
        if run.signs >= _NOT_STIFF and rate * run.last_step < _STABLE:
            self._change(run, AUTO_EXPLICIT, rate)
            return
        gone = max(_NOT_STIFF, run.steps - self._since)
        signs = run.signs + _NOT_STIFF if run.signs >= _NOT_STIFF else _NOT_STIFF
        self._ask(run, signs, self._since + 2 * gone, _short(rate))

    def _change(self, run: Integrator, method: str, rate: float) -> None:
        implicit = method != AUTO_EXPLICIT
        steps = run.steps
        if implicit:
            self._system.offer_tangent()
        run.change(get(method))
        why = "stability set the steps" if implicit else "its steps are stable for it"
        self.stretches.append(MethodSegment(run.t, method, rate, why))
        self._since = steps
        if implicit:
            self._ask(run, _NOT_STIFF, steps + _NOT_STIFF, _short(rate))
        else:
            self._ask(run, _STIFF)

    def _ask(self, run: Integrator, signs: int, look: int = 0, short: float = 0.0) -> None:
        self._asked_for = (signs, look, short)
        run.call_back(*self._asked_for)

    # --- checkpoints ----------------------------------------------------------------------------

    def state(self) -> str:
        """Everything that a new process needs, as text."""
        return json.dumps({
            "stretches": [asdict(s) for s in self.stretches],
            "asked_for": self._asked_for, "since": self._since,
        })  # fmt: skip

    def restore(self, run: Integrator, state: str) -> None:
        """Put the choice where `state` was taken, and its method into the run; then restore that.

        Raises ValueError for a text that no choice wrote.
        """
        try:
            found = json.loads(state)
            self.stretches = list(from_rows(found["stretches"]))
            signs, look, short = found["asked_for"]
            self._asked_for = (int(signs), int(look), float(short))
            self._since = int(found["since"])
            method = self.stretches[-1].method
        except (KeyError, TypeError, IndexError) as error:
            raise ValueError(str(error)) from None
        if method not in (AUTO_EXPLICIT, implicit_method(self._settings.rtol)):
            raise ValueError(method)
        if method != AUTO_EXPLICIT:
            self._system.offer_tangent()
            run.change(get(method))
        run.call_back(*self._asked_for)


def _short(rate: float) -> float:
    return _STABLE / rate if rate > 0.0 else math.inf
