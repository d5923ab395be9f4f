"""`method = "auto"`: switch between an explicit and an implicit method within a run.

A run starts with dop853, whose steps detect the stability limit at no cost.  When most of the last
steps reached that limit, the fastest motion due to laws and modes is estimated.  If this motion
limits the steps and is fast compared with the whole run, the run continues with a Rosenbrock
method, and returns to dop853 once the steps would be stable for an explicit method.  The results of
a run that is not stiff equal those of dop853 bit by bit.
"""

from __future__ import annotations

import json
import math

from mstmm.errors import NumericalFailure, SceneError
from mstmm.plain_data import to_plain

from ..integrate.c_loop import Integrator
from ..integrate.settings import Settings
from ..integrate.steppers import AUTO_EXPLICIT, get
from ..packing.scene_packing import reject_qr_steps
from .scene_system import SceneSystem
from .spectral_radius import FastestMode
from .trajectory import MethodSegment, from_rows

#: Number of recent steps that must indicate a change: to an implicit method, and back.
_STIFF_STEPS, _NONSTIFF_STEPS = 5, 10

#: h |lambda| up to which a step of an explicit method is stable.
_STABLE_PRODUCT = 2.5

#: |lambda| times the duration of a run up to which an explicit method always costs less.
_EXPLICIT_PRODUCT = 2000.0

#: Tolerance from which on the implicit method of lower order costs less.
_LOOSE_RTOL = 1e-5


def implicit_method(rtol: float) -> str:
    """Implicit method that "auto" uses for a tolerance."""
    return "rodas4p2" if rtol >= _LOOSE_RTOL else "rodas5p"


class MethodChoice:
    """Choice of method within one run; call `switch_if_indicated` between its slices."""

    def __init__(self, system: SceneSystem, settings: Settings, run: Integrator) -> None:
        self._system, self._settings = system, settings
        self._fastest: FastestMode | None = None
        self._request = (_STIFF_STEPS, 0, 0.0)
        self._first_step = 0  # steps of the run before the present method
        self.segments = [
            MethodSegment(settings.t_start, AUTO_EXPLICIT, None, "initial method of every run")
        ]
        run.request_return(*self._request)

    def switch_if_indicated(self, run: Integrator) -> None:
        """Change the method if the run returned for that and its steps indicate it."""
        rate = self._fastest_rate(run) if run.callback_requested else None
        if rate is None:
            return
        if run.tableau.implicit:
            self._check_nonstiff(run, rate)
        elif self._is_stiff(run, rate):
            self._change_method(run, implicit_method(self._settings.rtol), rate)
        else:
            self._request_return(run, 2 * self._request[0])

    def rescue(self, run: Integrator) -> bool:
        """Continue explicitly, to the end, a run whose implicit method found no step.

        Returns whether the run continues.
        """
        if not (run.tableau.implicit and run.no_step):
            return False
        reason = f"{run.tableau.name} found no step"
        run.switch_method(get(AUTO_EXPLICIT))
        self.segments.append(MethodSegment(run.t, AUTO_EXPLICIT, None, reason))
        self._request_return(run, 0)
        return True

    def _fastest_rate(self, run: Integrator) -> float | None:
        """|lambda| in 1/s at the present state, 0 where it cannot be computed.

        None, and no further requests, for scenes that no implicit method supports.
        """
        system, engine = self._system, self._system.engine
        if self._fastest is None:
            try:
                reject_qr_steps(engine.packed)
                self._fastest = FastestMode(engine, system.memory)
            except SceneError as error:
                reason = f"no implicit method: {error}"
                self.segments.append(MethodSegment(run.t, AUTO_EXPLICIT, None, reason))
                self._request_return(run, 0)
                return None
        q, u = run.y[: engine.nq], run.y[engine.nq : engine.nq + engine.nu]
        try:
            return self._fastest.rate(run.t, q, u)
        except NumericalFailure:
            return 0.0

    def _is_stiff(self, run: Integrator, rate: float) -> bool:
        span = self._settings.t_end - self._settings.t_start
        return rate * span > _EXPLICIT_PRODUCT and rate * run.last_step > _STABLE_PRODUCT

    def _check_nonstiff(self, run: Integrator, rate: float) -> None:
        """Return to the explicit method if enough implicit steps were short enough for it.

        Checked after 10, 20, 40, ... implicit steps, or when that many of them were short enough.
        """
        if run.signs >= _NONSTIFF_STEPS and rate * run.last_step < _STABLE_PRODUCT:
            self._change_method(run, AUTO_EXPLICIT, rate)
            return
        count = max(_NONSTIFF_STEPS, run.steps - self._first_step)
        signs = run.signs + _NONSTIFF_STEPS if run.signs >= _NONSTIFF_STEPS else _NONSTIFF_STEPS
        self._request_return(run, signs, self._first_step + 2 * count, _stable_step(rate))

    def _change_method(self, run: Integrator, method: str, rate: float) -> None:
        implicit = method != AUTO_EXPLICIT
        steps = run.steps
        if implicit:
            self._system.offer_tangent()
        run.switch_method(get(method))
        reason = "stability limited the steps" if implicit else "stable at the present step size"
        self.segments.append(MethodSegment(run.t, method, rate, reason))
        self._first_step = steps
        if implicit:
            self._request_return(run, _NONSTIFF_STEPS, steps + _NONSTIFF_STEPS, _stable_step(rate))
        else:
            self._request_return(run, _STIFF_STEPS)

    def _request_return(
        self, run: Integrator, signs: int, steps: int = 0, short: float = 0.0
    ) -> None:
        """Make the C loop return after `signs` indications, or at `steps` steps (0: never)."""
        self._request = (signs, steps, short)
        run.request_return(*self._request)

    # --- checkpoints ----------------------------------------------------------------------------

    def state(self) -> str:
        """State of the choice as JSON text, for a checkpoint."""
        return json.dumps({
            "stretches": to_plain(self.segments),
            "asked_for": self._request, "since": self._first_step,
        })  # fmt: skip

    def restore(self, run: Integrator, state: str) -> None:
        """Restore the choice from `state` and set its method in the run, before that is restored.

        Raises ValueError for an invalid text.
        """
        try:
            data = json.loads(state)
            self.segments = list(from_rows(data["stretches"]))
            signs, steps, short = data["asked_for"]
            self._request = (int(signs), int(steps), float(short))
            self._first_step = int(data["since"])
            method = self.segments[-1].method
        except (KeyError, TypeError, IndexError) as error:
            raise ValueError(str(error)) from None
        if method not in (AUTO_EXPLICIT, implicit_method(self._settings.rtol)):
            raise ValueError(method)
        if method != AUTO_EXPLICIT:
            self._system.offer_tangent()
            run.switch_method(get(method))
        run.request_return(*self._request)


def _stable_step(rate: float) -> float:
    """Longest step in s that an explicit method takes stably at |lambda| = `rate` (1/s)."""
    return _STABLE_PRODUCT / rate if rate > 0.0 else math.inf
