"""Callbacks of a scene for external integrators: rates, Jacobian, events, accepted steps."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array

from ...engine.jacobian import OdeJacobian
from ...integrate.c_loop import Status
from ..scene_system import SceneSystem

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene


class RunEnded(Exception):
    """The run ends before t_end, with a status and a message."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status, self.message = status, message


class Equations:
    """Callbacks of a model's `mstmm_system`, called from Python."""

    def __init__(self, model: CompiledScene) -> None:
        self.engine = model.looped
        self.scene = SceneSystem(self.engine)
        self.calls = self.scene.system
        self.ffi = self.engine.ffi
        self.bounds = (-np.inf, np.inf)
        self.failure, self.evaluations = "", 0
        memory = self.scene.memory
        self._jacobian = cache(lambda: OdeJacobian(model, self.scene.has_power, memory, self.rates))

    def rates(self, t: float, y: Array) -> Array:
        """dy/dt; nan where it cannot be evaluated, which makes SciPy try a smaller step."""
        state, rates = np.ascontiguousarray(y, dtype=np.float64), np.empty(len(y))
        code = self.calls.rhs(self.calls.context, self._inside(t), self._c(state), self._c(rates))
        self.evaluations += 1
        if code:
            self.failure = self.engine.failure_text(self.scene.run.failure, t)
            rates[:] = np.nan
        return rates

    def jacobian(self, t: float, y: Array) -> Array:
        """d(dy/dt)/dy, (n, n)."""
        return self._jacobian()(self._inside(t), np.ascontiguousarray(y, dtype=np.float64))

    def _inside(self, t: float) -> float:
        """`t`, clamped to times between the breaks, where the right-hand side is unique."""
        return min(max(t, self.bounds[0]), self.bounds[1])

    def _c(self, array: Array) -> Any:
        return self.ffi.from_buffer("double[]", array)

    def events(self, t: float, y: Array) -> Array:
        """Values of the events; negative where an event does not hold."""
        return self.event_values(t, y)[: self.calls.n_events]

    def event_values(self, t: float, y: Array) -> Array:
        """Values of the events, followed by the margins of switches."""
        values = self.scene.event_values(t, y)
        if values is None:
            text = self.engine.failure_text(self.scene.run.failure, t)
            raise RunEnded(Status.EVENT_FAILED, text)
        return values

    def read_numbers(self, t: float, y: Array, rates: Array) -> Any:
        """Numbers for `enclose` that conditions read at the state of the last `event_values`."""
        numbers = self.ffi.new("double[]", max(1, int(self.calls.n_seen)))
        state, slopes = (np.ascontiguousarray(x, dtype=np.float64) for x in (y, rates))
        self.calls.see(self.calls.context, t, self._c(state), self._c(slopes), numbers)
        return numbers

    def enclose(self, left: float, seen_left: Any, right: float, seen_right: Any) -> Array:
        """Bounds (n, 4) of all conditions between two times (s): low, high, and of the slope."""
        bounds = np.empty((self.calls.n_events + self.calls.n_switches, 4))
        record = self.ffi.cast("mstmm_bounds *", self._c(bounds))
        self.calls.enclose(self.calls.context, right - left, seen_left, seen_right, record)
        return bounds

    def passes_through(self, event: int, t: float, y: Array, value: float) -> bool:
        """True if a state moves into a bounce event, whose value there is given."""
        state = self._c(np.ascontiguousarray(y, dtype=np.float64))
        return bool(self.calls.lets_through(self.calls.context, event, t, state, value))

    def remember(self, t: float, y: Array) -> Array:
        """Accept a step: update the memory of turns and return the projected state."""
        state = np.array(y)
        if self.calls.accept == self.ffi.NULL:
            return state
        if self.calls.accept(self.calls.context, t, self._c(state)) > 0:  # below 0: rates change
            text = self.engine.failure_text(self.scene.run.failure, t)
            raise RunEnded(Status.ACCEPT_FAILED, text)
        return state

    def fire(self, event: int, t: float, y: Array) -> int:
        """Fire an event and return its action, MSTMM_FIRE_*; a bounce changes y in place."""
        return int(self.calls.fire(self.calls.context, event, t, self._c(y)))
