"""SciPy's integrators on the very same compiled call-backs: a second opinion on every run.

The classes behind `scipy.integrate.solve_ivp` are driven step by step, so that breaks, events,
releases, output times and Ctrl-C mean what they mean in the C loop.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.errors import SceneError

from .endings import busiest, cause_of
from .integrate import Samples, Statistics, Status
from .interruptible import interruptible
from .jacobian import Jacobian
from .settings import Settings
from .simulate import SceneSystem, Trajectory, split, tolerances

if TYPE_CHECKING:
    from .model import Model

Array = NDArray[np.float64]

#: Method of `simulate` -> name of SciPy's class.
METHODS = {f"scipy-{name}": name for name in ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")}

#: Those that solve equations in every step, and take their Jacobian.
_IMPLICIT = ("Radau", "BDF", "LSODA")

#: Points inside a step at which events are looked at.
_LOOKS = np.linspace(0.0, 1.0, 9)[1:]


#: Steps in a row that do not move the time: the integrator has given up without saying so.
_STUCK = 20


class _Ended(Exception):
    """The run is over before its end: why, and a sentence."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status, self.message = status, message


class Equations:
    """The call-backs of a model, taken from the C structure and called from Python."""

    def __init__(self, model: Model) -> None:
        self.engine = model._engine
        self.scene = SceneSystem(self.engine)
        self.calls = self.scene.system
        self.ffi = self.engine.ffi
        self.bounds = (-np.inf, np.inf)
        self.failure, self.evaluations = "", 0
        memory = self.scene.memory
        self._jacobian = cache(lambda: Jacobian(model, self.scene.with_power, memory, self.rates))

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
        """A break is never seen itself."""
        return min(max(t, self.bounds[0]), self.bounds[1])

    def _c(self, array: Array) -> Any:
        return self.ffi.from_buffer("double[]", array)

    def events(self, t: float, y: Array) -> Array:
        values = np.empty(max(1, self.calls.n_events))
        state = np.ascontiguousarray(y)
        if self.calls.n_events and self.calls.events(
            self.calls.context, t, self._c(state), self._c(values)
        ):
            text = self.engine.failure_text(self.scene.run.failure, t)
            raise _Ended(Status.EVENT_FAILED, text)
        return values[: self.calls.n_events]

    def remember(self, t: float, y: Array) -> Array:
        """After a step: memory of turns brought up to date; the settled state."""
        state = np.array(y)
        if self.calls.accept != self.ffi.NULL:  # where there is something to settle
            self.calls.accept(self.calls.context, t, self._c(state))
        return state

    def fire(self, event: int, t: float, y: Array) -> int:
        return int(self.calls.fire(self.calls.context, event, t, self._c(np.array(y))))


def integrate(
    model: Model, settings: Settings, q: Array, u: Array, tell: Callable[[float], None]
) -> Trajectory:
    """One run by SciPy.

    Raises SceneError for a fixed step or an unknown method.
    """
    if settings.step is not None:
        raise SceneError(f"method {settings.method!r} chooses its own steps: leave step out")
    return _Loop(model, settings, tell).run(q, u)


class _Loop:
    """Steps, breaks, events and samples of one run."""

    def __init__(self, model: Model, settings: Settings, tell: Callable[[float], None]) -> None:
        self.system, self.settings, self.tell = Equations(model), settings, tell
        self.rows: list[tuple[float, Array, Array, int]] = []
        self.outputs = None if settings.output_times is None else deque(settings.output_times)
        self.steps = self.fired = 0
        self.sizes: list[float] = []
        self.t, self.last = settings.t_start, np.zeros(0)
        self.flag = [False]
        self.truth = np.zeros(int(self.system.calls.n_events), dtype=bool)

    def run(self, q: Array, u: Array) -> Trajectory:
        scene, settings = self.system.scene, self.settings
        y = scene.start(settings.t_start, q, u)
        self.last, self.atol = y, tolerances(scene, settings, y)
        inner = [b for b in self.system.engine.packed.breaks
                 if settings.t_start < b < settings.t_end]  # fmt: skip
        status: Status | None
        try:
            with interruptible() as self.flag:
                self.sample(self.t, y)
                for stop in [*inner, settings.t_end]:
                    y = self.piece(y, stop)
            status, message = Status.FINISHED, f"finished at t = {self.t:.9g} s"
        except _Ended as ended:
            status, message = ended.status, ended.message
        except KeyboardInterrupt:
            status, message = None, f"interrupted at t = {self.t:.9g} s"
        return split(
            scene, self.samples(), settings, status, message, self.statistics(),
            (self.t, self.last),
        )  # fmt: skip

    def piece(self, y: Array, stop: float) -> Array:
        """From self.t to the next break, with a new integrator after every event."""
        self.system.bounds = (np.nextafter(self.t, np.inf), np.nextafter(stop, -np.inf))
        while self.t < stop:
            if self.fire_here(y):
                continue
            y = self.stretch(y, stop)
        self.fire_here(y)
        return y

    def stretch(self, y: Array, stop: float) -> Array:
        """Steps of one integrator, up to `stop` or an event."""
        self.refuse_start(y)
        solver, stuck = self.solver(y, stop), 0
        while solver.status == "running":
            self.look()
            text = self.step(solver)
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                raise self.failed(solver.y, text)
            stuck = stuck + 1 if solver.t == solver.t_old else 0
            if stuck > _STUCK:
                raise self.failed(solver.y, "the steps have become too small")
            self.steps += 1
            self.sizes.append(solver.t - solver.t_old)
            event = self.first_event(solver)
            end = solver.t if event is None else event[1]
            dense = solver.dense_output()
            self.outputs_until(dense, end)
            y = solver.y if event is None else dense(end)
            self.t, self.last = float(end), self.system.remember(end, y)
            self.tell(end)
            if event is not None:
                return np.array(self.last)
            if self.outputs is None:
                self.sample(end, solver.y)
            self.truth &= self.events(end, solver.y) >= 0
        return np.array(self.last)

    def refuse_start(self, y: Array) -> None:
        """SciPy chooses its first step from the rates: from nan a step that never ends."""
        self.system.failure = ""
        rates = self.system.rates(self.t, y)
        if not np.isfinite(rates).all():
            raise self.failed(rates, None)

    def look(self) -> None:
        """Between evaluations: has somebody asked for the end?"""
        if self.flag[0]:
            raise KeyboardInterrupt

    def step(self, solver: Any) -> str | None:
        """One step; a sentence where it fails."""
        limit = self.settings.max_steps
        if limit and self.steps >= limit:
            at = f"t = {self.t:.9g} s"
            text = f"more steps than allowed at {at}; last good state at {at}"
            raise _Ended(Status.TOO_MANY_STEPS, text)
        self.system.failure = ""
        try:
            with np.errstate(all="ignore"):  # nan is how a bad trial step shows
                found: str | None = solver.step()
        except (ValueError, np.linalg.LinAlgError) as error:
            found, solver.status = str(error), "failed"
        return found

    def solver(self, y: Array, stop: float) -> Any:
        import scipy.integrate

        name = METHODS[self.settings.method]
        kind = getattr(scipy.integrate, name)
        first = self.settings.first_step if self.t == self.settings.t_start else 0.0
        more = {"jac": self.system.jacobian} if name in _IMPLICIT else {}
        return kind(
            self.rates, self.t, y, stop, rtol=max(self.settings.rtol, 2.3e-14),
            atol=self.atol, max_step=self.settings.max_step or np.inf,
            first_step=min(first, stop - self.t) or None, **more,
        )  # fmt: skip

    def rates(self, t: float, y: Array) -> Array:
        """Rates for a step of SciPy's, which a step of endless trials does not outlive."""
        if METHODS[self.settings.method] != "LSODA":  # no exception passes through its C code
            self.look()
        return self.system.rates(t, y)

    def failed(self, y: Array, text: str | None) -> _Ended:
        at = f"last good state at t = {self.t:.9g} s"
        status = Status.RHS_FAILED if self.system.failure else Status.STEP_TOO_SMALL
        cause = cause_of(self.system.scene, status, self.t, self.last, self.t)
        if cause or self.system.failure:
            return _Ended(status, f"{cause or self.system.failure}; {at}")
        if not np.isfinite(y).all():
            name = self.system.scene.components()[int(np.argmin(np.isfinite(y)))]
            return _Ended(Status.NOT_FINITE, f"not finite: {name}; {at}")
        text = (text or "the integrator failed").strip(". ")
        where = busiest(self.system.scene, self.t, self.last)
        return _Ended(status, f"{text}; {at}{where}")

    # --- events ---------------------------------------------------------------------------------

    def events(self, t: float, y: Array) -> Array:
        """Conditions at a state; one that is not a number ends the run."""
        found = self.system.events(t, y)
        if np.isnan(found).any():
            name = self.system.scene.event_names[int(np.argmax(np.isnan(found)))]
            text = f"the condition of {name} is not a number at t = {t:.9g} s"
            at = f"last good state at t = {self.t:.9g} s"
            raise _Ended(Status.EVENT_FAILED, f"{text}; {at}")
        return found

    def fire_here(self, y: Array) -> bool:
        """Fire what has become true at self.t; True if the integrator must start again."""
        values = self.events(self.t, y)
        self.truth &= values >= 0
        self.last = np.array(y)
        for i in np.flatnonzero((values >= 0) & ~self.truth):
            return self.fire(int(i), y)
        return False

    def fire(self, event: int, y: Array) -> bool:
        lib, t = self.system.engine.lib, self.t
        before = (t, np.array(y), np.array(self.system.scene.memory), -(event + 1))
        answer = self.system.fire(event, t, y)
        self.truth[event], self.fired = True, self.fired + 1
        if self.rows and self.rows[-1][0] == t and np.array_equal(self.rows[-1][1], y):
            self.rows.pop()
        if answer != lib.MSTMM_FIRE_STOP:
            self.rows.append(before)
        self.rows.append((t, np.array(y), np.array(self.system.scene.memory), event + 1))
        if answer == lib.MSTMM_FIRE_STOP:
            name = self.system.scene.event_names[event]
            raise _Ended(Status.STOPPED, f"stopped by {name} at t = {t:.9g} s")
        return True

    def first_event(self, solver: Any) -> tuple[int, float] | None:
        """(event, time) of the first one that becomes true in the step."""
        if not len(self.truth):
            return None
        dense, left = solver.dense_output(), solver.t_old
        false = self.events(left, dense(left)) < 0
        for right in solver.t_old + _LOOKS * (solver.t - solver.t_old):
            values = self.events(right, dense(right))
            risen = [int(i) for i in np.flatnonzero((values >= 0) & false)]
            if risen:
                time, event = min((self.locate(dense, i, left, right), i) for i in risen)
                return event, time
            left, false = right, values < 0
        return None

    def locate(self, dense: Any, event: int, left: float, right: float) -> float:
        """The first number at which the event holds, by bisection."""
        while True:
            middle = left + (right - left) / 2
            if not left < middle < right:
                return right
            if self.events(middle, dense(middle))[event] >= 0:
                right = middle
            else:
                left = middle

    # --- samples --------------------------------------------------------------------------------

    def sample(self, t: float, y: Array) -> None:
        if self.outputs is not None:
            if not self.outputs or self.outputs[0] > t:
                return
            while self.outputs and self.outputs[0] <= t:
                self.outputs.popleft()
        self.rows.append((t, np.array(y), np.array(self.system.scene.memory), 0))

    def outputs_until(self, dense: Any, end: float) -> None:
        while self.outputs and self.outputs[0] <= end:
            t = self.outputs.popleft()
            self.rows.append((t, dense(t), np.array(self.system.scene.memory), 0))

    def samples(self) -> Samples:
        n_memory = int(self.system.calls.n_memory)
        rows = self.rows
        return Samples(
            np.array([t for t, *_ in rows]),
            np.array([y for _, y, *_ in rows]).reshape(len(rows), len(self.last)),
            np.array([m[:n_memory] for *_, m, _ in rows]).reshape(len(rows), n_memory),
            np.array([e for *_, e in rows], dtype=np.int64),
        )

    def statistics(self) -> Statistics:
        return Statistics(
            self.steps, 0, self.system.evaluations, self.fired,
            min(self.sizes, default=None), max(self.sizes, default=None),
            None, None, 0.0, 0.0, False, 0,
        )  # fmt: skip
