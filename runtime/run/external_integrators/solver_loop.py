"""Runs by integrators of others, step by step.

The classes behind `scipy.integrate.solve_ivp`, and CVODE of SUNDIALS, are driven step by step, so
that breaks, events, releases, output times and Ctrl-C mean what they mean in the C loop.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ...integrate.c_loop import Failure, Samples, Statistics, Status, failure_text
from ...integrate.settings import Settings
from ...platform_support.interrupts import Interrupt, record_interrupts
from ..integration_run import split, tolerances
from ..run_notes import chattering_note, unseen
from ..stop_messages import cause_of, end_of_curve, fastest_speed, rest_of
from ..switch_crossings import Crossings, ProgressCheck, just_before
from ..trajectory import Trajectory
from . import sundials
from .between import Between, Look
from .callbacks import Equations, RunEnded

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene


#: Method of `simulate` -> name of SciPy's class, or of CVODE's method.
METHODS = {
    f"scipy-{name}": name for name in ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
} | sundials.METHODS

#: Those that solve equations in every step, and take their Jacobian.
_IMPLICIT = ("Radau", "BDF", "LSODA")

#: Part of the next flight that the first step behind a blow takes at most, to end in the air.
_FLIGHT = 0.3

#: Points inside a step at which events are looked at.
_LOOKS = np.linspace(0.0, 1.0, 9)[1:]


#: Steps in a row that do not move the time: the integrator has given up without saying so.
_STUCK = 20

#: LSODA before SciPy 1.17 keeps its state in one place for the whole process: one run at a time.
_ONE_LSODA = RLock()

#: Two times so near to each other, as part of the time or the run, are one.
_GAP = 2.0**-39

#: An integrator that keeps its history to itself begins anew where its state is so many tolerances
#: beside the closed one: its errors are as large anyway, and it begins with steps of order 1.
_BESIDE = 100.0


def integrate(
    model: CompiledScene, settings: Settings, q: Array, u: Array, tell: Callable[[float], None]
) -> Trajectory:
    """One run by SciPy, or by SUNDIALS.

    Raises SceneError for a fixed step, and by SUNDIALS for a scene without coordinates;
    EnvironmentFailure where the package is not installed.
    """
    if settings.step is not None:
        raise SceneError(f'method "{settings.method}" chooses its own steps: leave step out')
    if settings.method in sundials.METHODS:
        sundials.refuse_without(settings.method)
        if not model.nq + model.nu:
            raise SceneError(
                f'method "{settings.method}": CVODE takes no scene in which nothing can move; '
                "use another method, such as dop853"
            )
    alone: AbstractContextManager[object] = nullcontext()
    if METHODS[settings.method] == "LSODA":
        alone = _ONE_LSODA
    with alone:
        return _Loop(model, settings, tell).run(q, u)


class _Loop:
    """Steps, breaks, events and samples of one run."""

    def __init__(
        self, model: CompiledScene, settings: Settings, tell: Callable[[float], None]
    ) -> None:
        self.system, self.settings, self.tell = Equations(model), settings, tell
        self.implicit = METHODS[settings.method] in _IMPLICIT
        self.rows: list[tuple[float, Array, Array, int]] = []
        self.outputs = None if settings.output_times is None else deque(settings.output_times)
        self.steps = self.fired = 0
        #: The last event, and how long before it another was, s.
        self.met, self.apart = settings.t_start, 0.0
        bounces = self.system.engine.packed.watched.bounces
        #: Part of its speed, at least, with which what is thrown back leaves; which events do that,
        #: and the one that has just done it.
        self.thrown = min((bounce.restitution for bounce in bounces), default=1.0)
        self.bounces = {bounce.event for bounce in bounces}
        self.aloft: int | None = None
        #: What is met at the end of the last step, though closing loops may have drawn it back.
        self.due: int | None = None
        self.sizes: list[float] = []
        self.t, self.last = settings.t_start, np.zeros(0)
        self.interrupted = Interrupt()
        calls = self.system.calls
        self.n_events = int(calls.n_events)
        self.closes = self.system.engine.packed.system.closes
        self.truth = np.zeros(self.n_events, dtype=bool)
        self.crossings = Crossings(int(calls.n_switches), settings.t_end - settings.t_start)
        self.unseen: tuple[int, float] | None = None
        self.sight = ProgressCheck(settings.t_start, settings.t_end)
        self.known = self.system.engine.packed.time_map(settings.t_start, settings.t_end)

    def run(self, q: Array, u: Array) -> Trajectory:
        scene, settings = self.system.scene, self.settings
        y = scene.begin(settings.t_start, q, u)
        self.last, self.atol = y, tolerances(scene, settings, y)
        stops = np.union1d(self.known.breaks, self.known.starts).tolist()
        inner = [b for b in stops if settings.t_start < b < settings.t_end]
        status: Status | None
        with record_interrupts() as self.interrupted:
            try:
                self.sample(self.t, y)
                for stop in [*inner, settings.t_end]:
                    y = self.piece(y, stop)
                status, message = Status.FINISHED, f"finished at t = {self.t:.9g} s"
            except RunEnded as ended:
                status, message = ended.status, ended.message
            except KeyboardInterrupt:
                status, message = None, f"interrupted at t = {self.t:.9g} s"
        found = split(
            scene, self.samples(), settings, status, message, self.statistics(),
            (self.t, self.last),
        )  # fmt: skip
        chatter = self.crossings.chatter
        risks = [] if chatter is None else [chattering_note(scene, chatter)]
        risks += [] if self.unseen is None else [unseen(scene, *self.unseen)]
        return replace(found, risks=tuple(risks))

    def piece(self, y: Array, stop: float) -> Array:
        """From self.t to the next break, with a new integrator after every event.

        Between two breaks that are one but for rounding nothing changes.
        """
        if self.known.pole is not None and self.t >= self.known.pole[0]:
            found = Failure(Status.POLE, self.t, None, None, 0)
            at = f"last good state at t = {self.t:.9g} s"
            raise RunEnded(Status.POLE, f"{failure_text(found, cause=self.known.pole[1])}; {at}")
        if self.is_now(stop):
            self.t = stop
            return y
        self.system.bounds = (np.nextafter(self.t, np.inf), np.nextafter(stop, -np.inf))
        while self.t < stop:
            if self.fire_here(y):
                continue
            y = self.stretch(y, stop)
        self.fire_here(y)
        return y

    def is_now(self, t: float) -> bool:
        """Whether a time is this one, but for rounding."""
        span = self.settings.t_end - self.settings.t_start
        return abs(t - self.t) <= _GAP * max(abs(self.t), span)

    def stretch(self, y: Array, stop: float) -> Array:
        """Steps of one integrator, up to `stop`, an event or a switch.

        A step with a switch in it is made again, to end just before; see phase_switch in C.
        """
        self.refuse_start(y)
        solver, stuck = self.solver(y, stop), 0
        while solver.status == "running":
            self.look()
            text = self.step(solver)
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                raise self.failed(solver.y, text)
            if not self.sight.has_end(float(solver.t)):
                raise self.endless()
            stuck = stuck + 1 if solver.t == solver.t_old else 0
            if stuck > _STUCK:
                raise self.failed(solver.y, "the steps have become too small")
            self.steps += 1
            self.sizes.append(solver.t - solver.t_old)
            switch = self.first_switch(solver)
            if switch is not None and not self.crossings.is_short(switch[1] - solver.t_old):
                self.steps -= 1
                self.sizes.pop()
                return self.stretch(self.last, just_before(solver.t_old, switch[1]))
            event = self.first_event(solver, switch)
            end = solver.t if event is None else event[1]
            dense = solver.dense_output()
            self.outputs_until(dense, end, event is not None)
            y = solver.y if event is None else dense(end)
            self.t, self.last = float(end), self.system.remember(end, y)
            self.tell(end)
            if event is not None:
                self.crossed(event)
                return np.array(self.last)
            self.sample(end, solver.y)
            values = self.events(end, solver.y)
            self.truth &= values >= 0
            self.refuse_unseen_flight()
            self.refuse_let_through(solver.y, values)
            if self.closes and not _goes_on(solver, self.last, self.atol, self.settings.rtol):
                break
        return np.array(self.last)

    def refuse_unseen_flight(self) -> None:
        """What does not leave by a fraction of its flight flies lower than the tolerances see."""
        thrown, self.aloft = self.aloft, None
        if thrown is not None and self.truth[thrown]:
            raise self.stopped(thrown)

    def refuse_let_through(self, y: Array, values: Array) -> None:
        """What lies on an event that throws back is not thrown back by it."""
        for event in self.bounces:
            if self.truth[event] and self.system.lets_through(event, self.t, y, values[event]):
                found = Failure(Status.LET_THROUGH, self.t, None, event, 0)
                text = failure_text(found, events=self.system.scene.event_names)
                raise RunEnded(Status.LET_THROUGH, text)

    def stopped(self, event: int) -> RunEnded:
        """The end of a run that an event stops, or what comes to rest there."""
        scene = self.system.scene
        said = f"stopped by {scene.event_names[event]} at t = {self.t:.9g} s"
        rest = rest_of(scene, event)
        return RunEnded(Status.CAME_TO_REST if rest else Status.STOPPED, said + rest)

    def refuse_start(self, y: Array) -> None:
        """SciPy chooses its first step from the rates: from nan a step that never ends."""
        self.system.failure = ""
        rates = self.system.rates(self.t, y)
        if not np.isfinite(rates).all():
            raise self.failed(rates, None)

    def look(self) -> None:
        """Between evaluations: has somebody asked for the end?"""
        if self.interrupted:
            raise KeyboardInterrupt

    def step(self, solver: Any) -> str | None:
        """One step; a sentence where it fails."""
        limit = self.settings.max_steps
        if limit and self.steps >= limit:
            at = f"t = {self.t:.9g} s"
            text = f"more steps than allowed at {at}; last good state at {at}"
            raise RunEnded(Status.TOO_MANY_STEPS, text)
        self.system.failure = ""
        try:
            with np.errstate(all="ignore"):  # nan is how a bad trial step shows
                found: str | None = solver.step()
        except (ValueError, np.linalg.LinAlgError) as error:
            found, solver.status = str(error), "failed"
        return found

    def endless(self) -> RunEnded:
        """At the pace of the last steps the run would never end."""
        end = end_of_curve(self.system.scene, self.t, self.last, self.t)
        if end:
            text = f"{end}; last good state at t = {self.t:.9g} s"
            return RunEnded(Status.TOO_MANY_STEPS, text)
        sticks = Failure(Status.TOO_MANY_STEPS, self.t, None, None, 1)
        text = failure_text(sticks, implicit=self.implicit)
        if self.crossings.chatter is not None:
            text += f"; {chattering_note(self.system.scene, self.crossings.chatter)}"
        return RunEnded(Status.TOO_MANY_STEPS, text)

    def crossed(self, event: tuple[int, float]) -> None:
        """The step ended where a switch crosses, or what an event strikes is met."""
        if event[0] in self.bounces:
            self.due = event[0]
        if event[0] >= self.n_events:
            self.crossings.note(event[0] - self.n_events, self.t)
            if self.outputs is None:
                self.sample(self.t, self.last)

    def solver(self, y: Array, stop: float) -> Any:
        import scipy.integrate

        method = self.settings.method
        name, longest = METHODS[method], self.longest_step()
        first = self.settings.first_step if self.t == self.settings.t_start else 0.0
        if self.apart:  # events that follow ever faster are not to be stepped over
            first = self.apart * _FLIGHT * self.thrown
        first = min(first, stop - self.t)
        common = {"rtol": max(self.settings.rtol, 2.3e-14), "atol": self.atol}
        if method in sundials.METHODS:
            return sundials.Cvode(
                method, self.rates, self.system.jacobian, self.t, y, stop, first_step=first,
                max_step=longest, **common,
            )  # fmt: skip
        more = {"jac": self.system.jacobian} if name in _IMPLICIT else {}
        return getattr(scipy.integrate, name)(
            self.rates, self.t, y, stop, max_step=longest, first_step=first or None, **common,
            **more,
        )  # fmt: skip

    def longest_step(self) -> float:
        """What max_step and the loads allow from self.t to the next stop."""
        starts, longest = self.known.starts, self.known.longest
        here = int(np.searchsorted(starts, self.t, side="right")) - 1
        bound = float(longest[here]) if here >= 0 else np.inf
        return min(self.settings.max_step or np.inf, bound)

    def rates(self, t: float, y: Array) -> Array:
        """Rates for a step of SciPy's, which a step of endless trials does not outlive."""
        if METHODS[self.settings.method] != "LSODA":  # no exception passes through its C code
            self.look()
        return self.system.rates(t, y)

    def failed(self, y: Array, text: str | None) -> RunEnded:
        at = f"last good state at t = {self.t:.9g} s"
        status = Status.RHS_FAILED if self.system.failure else Status.STEP_TOO_SMALL
        cause = cause_of(self.system.scene, status, self.t, self.last, self.t, self.implicit)
        if cause or self.system.failure:
            return RunEnded(status, f"{cause or self.system.failure}; {at}")
        if not np.isfinite(y).all():
            name = self.system.scene.components()[int(np.argmin(np.isfinite(y)))]
            return RunEnded(Status.NOT_FINITE, f"not finite: {name}; {at}")
        text = (text or "the integrator failed").strip(". ")
        where = fastest_speed(self.system.scene, self.t, self.last)
        return RunEnded(status, f"{text}; {at}{where}")

    # --- events ---------------------------------------------------------------------------------

    def events(self, t: float, y: Array) -> Array:
        """Conditions at a state; one that is not a number ends the run."""
        return self.watched(t, y)[: self.n_events]

    def watched(self, t: float, y: Array) -> Array:
        """The same, and behind them the margins of switches."""
        found = self.system.watched(t, y)
        no_number = np.isnan(found[: self.n_events])
        if no_number.any():
            name = self.system.scene.event_names[int(np.argmax(no_number))]
            text = f"the condition of {name} is not a number at t = {t:.9g} s"
            at = f"last good state at t = {self.t:.9g} s"
            raise RunEnded(Status.EVENT_FAILED, f"{text}; {at}")
        return found

    def fire_here(self, y: Array) -> bool:
        """Fire what has become true at self.t; True if the integrator must start again."""
        values = self.events(self.t, y)
        self.truth &= values >= 0
        self.last = np.array(y)
        rising = (values >= 0) & ~self.truth
        due, self.due = self.due, None
        if due is not None:
            rising[due] = True
        for i in np.flatnonzero(rising):
            return self.fire(int(i), y)
        return False

    def fire(self, event: int, y: Array) -> bool:
        lib, t = self.system.engine.lib, self.t
        before = (t, np.array(y), np.array(self.system.scene.memory), -(event + 1))
        answer = self.system.fire(event, t, y)
        self.last = np.array(y)
        self.truth[event], self.fired = True, self.fired + 1
        if not self.is_now(self.met):
            self.met, self.apart = t, t - self.met
        if self.rows and self.rows[-1][0] == t and np.array_equal(self.rows[-1][1], y):
            self.rows.pop()
        if answer != lib.MSTMM_FIRE_STOP:
            self.rows.append(before)
        self.rows.append((t, np.array(y), np.array(self.system.scene.memory), event + 1))
        if answer == lib.MSTMM_FIRE_STOP:
            raise self.stopped(event)
        self.aloft = event if self.apart and event in self.bounces else None
        return True

    def first_switch(self, solver: Any) -> tuple[int, float] | None:
        """(number behind the events, time) of the first switch that crosses in the step."""
        if not self.crossings.n:
            return None
        between, n = self.between(solver), self.n_events
        left = between.look(float(solver.t_old))
        signs = -np.sign(left.values)  # of what is to become true; 0 until a switch leaves zero
        for place in solver.t_old + _LOOKS * (solver.t - solver.t_old):
            right = between.look(float(place))
            numbers = np.flatnonzero(self.crossings.watched) + n
            watched = [i for i in numbers.tolist() if signs[i]]
            found = self.first_of(between, watched, signs, left, right)
            if found is not None:
                return found
            signs = np.where(signs == 0, -np.sign(right.values), signs)
            left = right
        return None

    def first_event(
        self, solver: Any, switch: tuple[int, float] | None
    ) -> tuple[int, float] | None:
        """(event, time) of the first one that becomes true in the step, or the switch in it."""
        if not len(self.truth):
            return switch
        between, n = self.between(solver), self.n_events
        left = between.look(float(solver.t_old))
        end = solver.t if switch is None else switch[1]
        false = (left.values[:n] < 0) | ~self.truth
        for place in solver.t_old + _LOOKS * (end - solver.t_old):
            right = between.look(float(place))
            found = self.first_of(between, np.flatnonzero(false).tolist(), np.ones(n), left, right)
            if found is not None:
                return found
            left, false = right, right.values[:n] < 0
        return switch

    def between(self, solver: Any) -> Between:
        """Conditions within the last step."""
        start, end = float(solver.t_old), float(solver.t)
        dense = solver.dense_output()
        return Between(self.system, self.watched, dense, start, end, self.unseen)

    def first_of(
        self, between: Between, numbers: list[int], signs: Array, left: Look, right: Look
    ) -> tuple[int, float] | None:
        """(number, time) of the first of what is watched to become true between two looks."""
        times = {i: between.first(i, float(signs[i]), left, right) for i in numbers}
        found = [(time, i) for i, time in times.items() if time is not None]
        self.unseen = between.unseen
        return min(found)[::-1] if found else None

    # --- samples --------------------------------------------------------------------------------

    def sample(self, t: float, y: Array) -> None:
        if self.outputs is not None:
            if not self.outputs or self.outputs[0] > t:
                return
            while self.outputs and self.outputs[0] <= t:
                self.outputs.popleft()
        self.rows.append((t, np.array(y), np.array(self.system.scene.memory), 0))

    def outputs_until(self, dense: Any, end: float, there: bool) -> None:
        """Samples within a step, and at its end where an event is `there`; else that is settled
        first."""
        while self.outputs and (self.outputs[0] < end or (there and self.outputs[0] == end)):
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
            None, None, 0.0, 0.0, False, 0, self.crossings.count,
        )  # fmt: skip


def _goes_on(solver: Any, closed: Array, atol: Array, rtol: float) -> bool:
    """Whether an integrator goes on from `closed` (n,), the state of its last step with loops
    closed; else another one is to begin there.

    What is known of the rates where the step ends is kept: its error is of higher order.
    """
    from scipy.integrate import BDF, DOP853, RK23, RK45, Radau

    if isinstance(solver, BDF):
        solver.D[0] = closed  # differences of order 0 are the state
    elif not isinstance(solver, DOP853 | RK23 | RK45 | Radau):
        beside = np.abs(closed - solver.y) / (atol + rtol * np.abs(closed))
        return float(beside.max(initial=0.0)) < _BESIDE
    solver.y = closed.copy()
    return True
