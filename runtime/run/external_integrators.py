"""Runs by the integrators of SciPy and SUNDIALS, step by step.

The solver classes of `scipy.integrate`, and CVODE of SUNDIALS, are called step by step, so that
breaks, events, releases, output times and Ctrl-C have the same effect as in the C loop.
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

from ..integrate.c_loop import Failure, Samples, Statistics, Status, failure_text
from ..integrate.settings import Settings
from ..platform_support.interrupts import Interrupt, record_interrupts
from . import sundials
from .event_location import (
    ConditionValues,
    Crossings,
    Equations,
    ProgressCheck,
    RunEnded,
    StepConditions,
    shortened_step_end,
)
from .integration_run import split, tolerances
from .run_messages import (
    chattering_note,
    curve_end_message,
    expression_cause,
    fastest_speed,
    rest_note,
    switch_notes,
)
from .trajectory import Trajectory

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


#: Method of `simulate` -> name of SciPy's class, or of CVODE's method.
METHODS = {
    f"scipy-{name}": name for name in ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
} | sundials.METHODS

#: Solver classes that solve equations in every step and need the Jacobian.
_IMPLICIT = ("Radau", "BDF", "LSODA")

#: Longest first step after a bounce, relative to the expected next flight, so that it ends before
#: the next impact.
_FLIGHT_SHARE = 0.3

#: Relative times inside a step at which conditions are evaluated.
_EVALUATION_POINTS = np.linspace(0.0, 1.0, 9)[1:]

#: Consecutive steps without progress in time after which the solver counts as failed.
_MAX_STUCK_STEPS = 20

#: LSODA before SciPy 1.17 has a single state per process, so that only one run may use it.
_LSODA_LOCK = RLock()

#: Difference of equal times, relative to the time or to the run.
_TIME_TOLERANCE = 2.0**-39

#: Difference between the solver's state and the projected one, in tolerances, from which on a
#: solver with inaccessible history restarts.  Its own errors are as large, and each restart costs
#: steps of order 1.
_RESTART_DIFFERENCE = 100.0


def integrate(
    model: CompiledScene,
    settings: Settings,
    q: Array,
    u: Array,
    report_time: Callable[[float], None],
) -> Trajectory:
    """Run the model from (nq,), (nu,) by SciPy or by SUNDIALS.

    `report_time` receives the reached time in s.  Raises SceneError for a fixed step, and with
    SUNDIALS for a scene without coordinates; EnvironmentFailure where the package is not installed.
    """
    if settings.step is not None:
        raise SceneError(f'method "{settings.method}" chooses its own steps; leave step out')
    if settings.method in sundials.METHODS:
        sundials.require_package(settings.method)
        if not model.nq + model.nu:
            raise SceneError(
                f'method "{settings.method}": CVODE does not support a scene without coordinates; '
                "use another method, such as dop853"
            )
    lock: AbstractContextManager[object] = nullcontext()
    if METHODS[settings.method] == "LSODA":
        lock = _LSODA_LOCK
    with lock:
        return _Loop(model, settings, report_time).run(q, u)


class _Loop:
    """Steps, breaks, events and samples of one run."""

    def __init__(
        self, model: CompiledScene, settings: Settings, report_time: Callable[[float], None]
    ) -> None:
        self.system, self.settings, self.report_time = Equations(model), settings, report_time
        self.implicit = METHODS[settings.method] in _IMPLICIT
        self.rows: list[tuple[float, Array, Array, int]] = []
        self.outputs = None if settings.output_times is None else deque(settings.output_times)
        self.steps = self.event_count = 0
        #: Time of the last event, and time between the last two events, s.
        self.event_time, self.event_interval = settings.t_start, 0.0
        bounces = self.system.engine.packed.event_functions.bounces
        self.min_restitution = min((bounce.restitution for bounce in bounces), default=1.0)
        self.bounces = {bounce.event for bounce in bounces}  # numbers of bounce events
        self.last_bounce: int | None = None  # bounce event from which the present step starts
        #: Bounce event at the end of the last step, to fire even if the projection onto closed
        #: loops has moved the state back from it.
        self.due: int | None = None
        self.sizes: list[float] = []
        self.t, self.last = settings.t_start, np.zeros(0)
        self.interrupted = Interrupt()
        calls = self.system.calls
        self.n_events = int(calls.n_events)
        self.closes = self.system.engine.packed.system.has_loops
        self.is_true = np.zeros(self.n_events, dtype=bool)
        self.crossings = Crossings(int(calls.n_switches), settings.t_end - settings.t_start)
        self.missed_crossing: tuple[int, float] | None = None
        self.progress = ProgressCheck(settings.t_start, settings.t_end)
        self.time_map = self.system.engine.packed.time_map(settings.t_start, settings.t_end)

    def run(self, q: Array, u: Array) -> Trajectory:
        scene, settings = self.system.scene, self.settings
        y = scene.begin(settings.t_start, q, u)
        self.last, self.atol = y, tolerances(scene, settings, y)
        stops = np.union1d(self.time_map.breaks, self.time_map.starts).tolist()
        inner = [b for b in stops if settings.t_start < b < settings.t_end]
        status: Status | None
        with record_interrupts() as self.interrupted:
            try:
                self.sample(self.t, y)
                for stop in [*inner, settings.t_end]:
                    y = self.run_piece(y, stop)
                status, message = Status.FINISHED, f"finished at t = {self.t:.9g} s"
            except RunEnded as ended:
                status, message = ended.status, ended.message
            except KeyboardInterrupt:
                status, message = None, f"interrupted at t = {self.t:.9g} s"
        result = split(
            scene, self.samples(), settings, status, message, self.statistics(),
            (self.t, self.last),
        )  # fmt: skip
        risks = switch_notes(scene, self.crossings.chatter, self.missed_crossing)
        return replace(result, risks=tuple(risks))

    def run_piece(self, y: Array, stop: float) -> Array:
        """Run from self.t to the break at `stop` (s), with a new solver after every event.

        Breaks that differ only by rounding count as one.
        """
        pole = self.time_map.pole
        if pole is not None and self.t >= pole[0]:
            failure = Failure(Status.POLE, self.t, None, None, 0)
            at = f"last good state at t = {self.t:.9g} s"
            raise RunEnded(Status.POLE, f"{failure_text(failure, cause=pole[1])}; {at}")
        if self.is_now(stop):
            self.t = stop
            return y
        self.system.bounds = (np.nextafter(self.t, np.inf), np.nextafter(stop, -np.inf))
        while self.t < stop:
            if self.fire_events(y):
                continue
            y = self.run_solver(y, stop)
        self.fire_events(y)
        return y

    def is_now(self, t: float) -> bool:
        """True if a time (s) equals self.t up to rounding."""
        span = self.settings.t_end - self.settings.t_start
        return abs(t - self.t) <= _TIME_TOLERANCE * max(abs(self.t), span)

    def run_solver(self, y: Array, stop: float) -> Array:
        """Make steps with one solver, up to `stop` (s), an event or a switch.

        A step with a switch in it is repeated, to end just before the switch; see phase_switch in
        C.
        """
        self.check_start(y)
        solver, stuck_steps = self.make_solver(y, stop), 0
        while solver.status == "running":
            self.check_interrupt()
            text = self.step(solver)
            if solver.status == "failed" or not np.isfinite(solver.y).all():
                raise self.failure(solver.y, text)
            if not self.progress.can_reach_end(float(solver.t)):
                raise self.no_progress()
            stuck_steps = stuck_steps + 1 if solver.t == solver.t_old else 0
            if stuck_steps > _MAX_STUCK_STEPS:
                raise self.failure(solver.y, "the steps have become too small")
            self.steps += 1
            self.sizes.append(solver.t - solver.t_old)
            switch = self.first_switch(solver)
            if switch is not None and not self.crossings.is_short(switch[1] - solver.t_old):
                self.steps -= 1
                self.sizes.pop()
                return self.run_solver(self.last, shortened_step_end(solver.t_old, switch[1]))
            event = self.first_event(solver, switch)
            end = solver.t if event is None else event[1]
            dense = solver.dense_output()
            self.sample_outputs(dense, end, event is not None)
            y = solver.y if event is None else dense(end)
            self.t, self.last = float(end), self.system.remember(end, y)
            self.report_time(end)
            if event is not None:
                self.note_crossing(event)
                return np.array(self.last)
            self.sample(end, solver.y)
            values = self.events(end, solver.y)
            self.is_true &= values >= 0
            self.check_bounce_height()
            self.check_pass_through(solver.y, values)
            if self.closes and not _accepts_projection(
                solver, self.last, self.atol, self.settings.rtol
            ):
                break
        return np.array(self.last)

    def check_bounce_height(self) -> None:
        """Stop at a bounce event that still holds after the first step away from it.

        The flight is then lower than the tolerances resolve.
        """
        bounce, self.last_bounce = self.last_bounce, None
        if bounce is not None and self.is_true[bounce]:
            raise self.end_at_event(bounce)

    def check_pass_through(self, y: Array, values: Array) -> None:
        """Stop a run that moves from rest on a bounce event into it, where nothing bounces."""
        for event in self.bounces:
            if self.is_true[event] and self.system.passes_through(event, self.t, y, values[event]):
                failure = Failure(Status.LET_THROUGH, self.t, None, event, 0)
                text = failure_text(failure, events=self.system.scene.event_names)
                raise RunEnded(Status.LET_THROUGH, text)

    def end_at_event(self, event: int) -> RunEnded:
        """End of the run at an event that stops it, or where its bounces come to rest."""
        scene = self.system.scene
        message = f"stopped by {scene.event_names[event]} at t = {self.t:.9g} s"
        note = rest_note(scene, event)
        return RunEnded(Status.CAME_TO_REST if note else Status.STOPPED, message + note)

    def check_start(self, y: Array) -> None:
        """Stop if the rates are not finite: SciPy's choice of a first step would not end."""
        self.system.failure = ""
        rates = self.system.rates(self.t, y)
        if not np.isfinite(rates).all():
            raise self.failure(rates, None)

    def check_interrupt(self) -> None:
        """Raise KeyboardInterrupt after an interrupt."""
        if self.interrupted:
            raise KeyboardInterrupt

    def step(self, solver: Any) -> str | None:
        """Make one step; returns a sentence if it fails."""
        limit = self.settings.max_steps
        if limit and self.steps >= limit:
            at = f"t = {self.t:.9g} s"
            message = f"more steps than allowed at {at}; last good state at {at}"
            raise RunEnded(Status.TOO_MANY_STEPS, message)
        self.system.failure = ""
        try:
            with np.errstate(all="ignore"):  # bad trial steps produce nan
                text: str | None = solver.step()
        except (ValueError, np.linalg.LinAlgError) as error:
            text, solver.status = str(error), "failed"
        return text

    def no_progress(self) -> RunEnded:
        """End of a run whose steps are too short for it to reach t_end."""
        curve_end = curve_end_message(self.system.scene, self.t, self.last, self.t)
        if curve_end:
            text = f"{curve_end}; last good state at t = {self.t:.9g} s"
            return RunEnded(Status.TOO_MANY_STEPS, text)
        failure = Failure(Status.TOO_MANY_STEPS, self.t, None, None, 1)
        text = failure_text(failure, implicit=self.implicit)
        if self.crossings.chatter is not None:
            text += f"; {chattering_note(self.system.scene, self.crossings.chatter)}"
        return RunEnded(Status.TOO_MANY_STEPS, text)

    def note_crossing(self, event: tuple[int, float]) -> None:
        """Note the switch or the bounce event at which the last step ended."""
        if event[0] in self.bounces:
            self.due = event[0]
        if event[0] >= self.n_events:
            self.crossings.note(event[0] - self.n_events, self.t)
            if self.outputs is None:
                self.sample(self.t, self.last)

    def make_solver(self, y: Array, stop: float) -> Any:
        import scipy.integrate

        method = self.settings.method
        name, max_step = METHODS[method], self.max_step()
        first = self.settings.first_step if self.t == self.settings.t_start else 0.0
        if self.event_interval:  # the first step must not miss the next of accumulating events
            first = self.event_interval * _FLIGHT_SHARE * self.min_restitution
        first = min(first, stop - self.t)
        tolerances = {"rtol": max(self.settings.rtol, 2.3e-14), "atol": self.atol}
        if method in sundials.METHODS:
            return sundials.Cvode(
                method, self.rates, self.system.jacobian, self.t, y, stop, first_step=first,
                max_step=max_step, **tolerances,
            )  # fmt: skip
        jacobian = {"jac": self.system.jacobian} if name in _IMPLICIT else {}
        return getattr(scipy.integrate, name)(
            self.rates, self.t, y, stop, max_step=max_step, first_step=first or None, **tolerances,
            **jacobian,
        )  # fmt: skip

    def max_step(self) -> float:
        """Longest step (s) that the settings and the loads permit from self.t on."""
        starts, longest = self.time_map.starts, self.time_map.longest
        piece = int(np.searchsorted(starts, self.t, side="right")) - 1
        bound = float(longest[piece]) if piece >= 0 else np.inf
        return min(self.settings.max_step or np.inf, bound)

    def rates(self, t: float, y: Array) -> Array:
        """dy/dt; an interrupt ends a step here, even one with endless trials."""
        if METHODS[self.settings.method] != "LSODA":  # no exception passes through its C code
            self.check_interrupt()
        return self.system.rates(t, y)

    def failure(self, y: Array, text: str | None) -> RunEnded:
        """End of the run after a failed step; y is the solver's state or the rates."""
        at = f"last good state at t = {self.t:.9g} s"
        status = Status.RHS_FAILED if self.system.failure else Status.STEP_TOO_SMALL
        cause = expression_cause(
            self.system.scene, status, self.t, self.last, self.t, self.implicit
        )
        if cause or self.system.failure:
            return RunEnded(status, f"{cause or self.system.failure}; {at}")
        if not np.isfinite(y).all():
            name = self.system.scene.components()[int(np.argmin(np.isfinite(y)))]
            return RunEnded(Status.NOT_FINITE, f"not finite: {name}; {at}")
        text = (text or "the integrator failed").strip(". ")
        note = fastest_speed(self.system.scene, self.t, self.last)
        return RunEnded(status, f"{text}; {at}{note}")

    # --- events ---------------------------------------------------------------------------------

    def events(self, t: float, y: Array) -> Array:
        """Values of the events at a state; a value that is nan ends the run."""
        return self.event_values(t, y)[: self.n_events]

    def event_values(self, t: float, y: Array) -> Array:
        """Values of the events, then margins of switches; an event value of nan ends the run."""
        values = self.system.event_values(t, y)
        is_nan = np.isnan(values[: self.n_events])
        if is_nan.any():
            name = self.system.scene.event_names[int(np.argmax(is_nan))]
            text = f"the condition of {name} is not a number at t = {t:.9g} s"
            at = f"last good state at t = {self.t:.9g} s"
            raise RunEnded(Status.EVENT_FAILED, f"{text}; {at}")
        return values

    def fire_events(self, y: Array) -> bool:
        """Fire an event that has become true at self.t; True if the solver must restart."""
        values = self.events(self.t, y)
        self.is_true &= values >= 0
        self.last = np.array(y)
        rising = (values >= 0) & ~self.is_true
        due, self.due = self.due, None
        if due is not None:
            rising[due] = True
        for i in np.flatnonzero(rising):
            return self.fire(int(i), y)
        return False

    def fire(self, event: int, y: Array) -> bool:
        lib, t = self.system.engine.lib, self.t
        before = (t, np.array(y), np.array(self.system.scene.memory), -(event + 1))
        action = self.system.fire(event, t, y)
        self.last = np.array(y)
        self.is_true[event], self.event_count = True, self.event_count + 1
        if not self.is_now(self.event_time):
            self.event_time, self.event_interval = t, t - self.event_time
        if self.rows and self.rows[-1][0] == t and np.array_equal(self.rows[-1][1], y):
            self.rows.pop()
        if action != lib.MSTMM_FIRE_STOP:
            self.rows.append(before)
        self.rows.append((t, np.array(y), np.array(self.system.scene.memory), event + 1))
        if action == lib.MSTMM_FIRE_STOP:
            raise self.end_at_event(event)
        is_repeated_bounce = self.event_interval and event in self.bounces
        self.last_bounce = event if is_repeated_bounce else None
        return True

    def first_switch(self, solver: Any) -> tuple[int, float] | None:
        """(n_events + switch, time) of the first switch that crosses in the last step."""
        if not self.crossings.n:
            return None
        conditions, n = self.conditions(solver), self.n_events
        left = conditions.evaluate(float(solver.t_old))
        signs = -np.sign(left.values)  # signs after a crossing; 0 until a switch leaves zero
        for t in solver.t_old + _EVALUATION_POINTS * (solver.t - solver.t_old):
            right = conditions.evaluate(float(t))
            indices = np.flatnonzero(self.crossings.is_watched) + n
            indices_off_zero = [i for i in indices.tolist() if signs[i]]
            crossing = self.first_crossing(conditions, indices_off_zero, signs, left, right)
            if crossing is not None:
                return crossing
            signs = np.where(signs == 0, -np.sign(right.values), signs)
            left = right
        return None

    def first_event(
        self, solver: Any, switch: tuple[int, float] | None
    ) -> tuple[int, float] | None:
        """(event, time) of the first event in the last step before `switch`, else `switch`."""
        if not len(self.is_true):
            return switch
        conditions, n = self.conditions(solver), self.n_events
        left = conditions.evaluate(float(solver.t_old))
        end = solver.t if switch is None else switch[1]
        is_false = (left.values[:n] < 0) | ~self.is_true
        for t in solver.t_old + _EVALUATION_POINTS * (end - solver.t_old):
            right = conditions.evaluate(float(t))
            indices = np.flatnonzero(is_false).tolist()
            crossing = self.first_crossing(conditions, indices, np.ones(n), left, right)
            if crossing is not None:
                return crossing
            left, is_false = right, right.values[:n] < 0
        return switch

    def conditions(self, solver: Any) -> StepConditions:
        """Conditions within the last step."""
        start, end = float(solver.t_old), float(solver.t)
        dense = solver.dense_output()
        return StepConditions(
            self.system, self.event_values, dense, start, end, self.missed_crossing
        )

    def first_crossing(
        self,
        conditions: StepConditions,
        indices: list[int],
        signs: Array,
        left: ConditionValues,
        right: ConditionValues,
    ) -> tuple[int, float] | None:
        """(index, time) of the first of the given conditions to cross between left and right."""
        times = {i: conditions.first_crossing(i, float(signs[i]), left, right) for i in indices}
        crossings = [(time, i) for i, time in times.items() if time is not None]
        self.missed_crossing = conditions.missed_crossing
        return min(crossings)[::-1] if crossings else None

    # --- samples --------------------------------------------------------------------------------

    def sample(self, t: float, y: Array) -> None:
        if self.outputs is not None:
            if not self.outputs or self.outputs[0] > t:
                return
            while self.outputs and self.outputs[0] <= t:
                self.outputs.popleft()
        self.rows.append((t, np.array(y), np.array(self.system.scene.memory), 0))

    def sample_outputs(self, dense: Any, end: float, include_end: bool) -> None:
        """Store output times within a step, and at its end (an event) if `include_end`.

        The end of a step without an event is stored later, after its projection.
        """
        while self.outputs and (self.outputs[0] < end or (include_end and self.outputs[0] == end)):
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
            self.steps, 0, self.system.evaluations, self.event_count,
            min(self.sizes, default=None), max(self.sizes, default=None),
            None, None, 0.0, 0.0, False, 0, self.crossings.count,
        )  # fmt: skip


def _accepts_projection(solver: Any, closed: Array, atol: Array, rtol: float) -> bool:
    """True if a solver can continue from its projected last state `closed` (n,).

    Otherwise a new solver must start there.  The solver's rates at the end of the step remain:
    their error is of higher order.
    """
    from scipy.integrate import BDF, DOP853, RK23, RK45, Radau

    if isinstance(solver, BDF):
        solver.D[0] = closed  # differences of order 0 are the state
    elif not isinstance(solver, DOP853 | RK23 | RK45 | Radau):
        difference = np.abs(closed - solver.y) / (atol + rtol * np.abs(closed))
        return float(difference.max(initial=0.0)) < _RESTART_DIFFERENCE
    solver.y = closed.copy()
    return True
