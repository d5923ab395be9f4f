"""Callbacks of a scene for external integrators, and event location within their steps.

The search is that of the C loop (runtime/integrate/c/event_location.c): intervals of the step are
bisected until bounds of a condition and of its slope exclude any further crossing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array

from ..engine.jacobian import OdeJacobian
from ..integrate.c_loop import Status
from .scene_system import SceneSystem

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


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


#: Largest number of bisections of an interval, and the same once a crossing may have been missed.
_MAX_BISECTIONS, _MAX_BISECTIONS_AFTER_MISS = 2000, 64

#: Shortest interval, and width of the bounds from which on a crossing counts as possibly missed,
#: both relative to the first interval.
_MIN_INTERVAL, _MISS_TOLERANCE = 2.0**-40, 1e-6

#: Half the difference interval for slopes of the dense output, relative to the step.
_DIFFERENCE = 1e-5


@dataclass(frozen=True)
class ConditionValues:
    """Event functions and switch margins at a time (s), and the numbers that they read."""

    t: float
    values: Array
    numbers: Any


class StepConditions:
    """Conditions of `system` within one step from `start` to `end` (s).

    `dense` gives the states of the step, `watched` the values of conditions at a state.  `unseen`
    is the first condition of which a crossing may have been missed, and its time (s).
    """

    def __init__(
        self, system: Equations, watched: Callable[[float, Array], Array],
        dense: Callable[[float], Array], start: float, end: float,
        unseen: tuple[int, float] | None,
    ) -> None:  # fmt: skip
        self._system, self._evaluate_conditions, self._dense = system, watched, dense
        self._start, self._end = start, end
        self.missed_crossing = unseen

    def evaluate(self, t: float) -> ConditionValues:
        """Values of all conditions at a time (s) of the step."""
        y = self._dense(t)
        delta = max(_DIFFERENCE * (self._end - self._start), 8 * math.ulp(t))
        before, after = max(t - delta, self._start), min(t + delta, self._end)
        rates = (self._dense(after) - self._dense(before)) / ((after - before) or 1.0)
        values = self._evaluate_conditions(t, y)  # before `read_numbers`, which reads its numbers
        return ConditionValues(t, values, self._system.read_numbers(t, y, rates))

    def first_crossing(
        self, i: int, sign: float, left: ConditionValues, right: ConditionValues
    ) -> float | None:
        """Time (s) of the first crossing of condition i between left and right; None without one.

        A crossing is where `sign` times the value becomes positive, for an event also zero; it is
        not so at left.  The time is the first double after the crossing.
        """
        pending, count, min_width = [right], 0, math.inf
        max_count = _MAX_BISECTIONS if self.missed_crossing is None else _MAX_BISECTIONS_AFTER_MISS
        rounding = 4 * math.ulp(max(abs(left.t), abs(right.t)))
        min_interval = max(rounding, _MIN_INTERVAL * (right.t - left.t))
        while pending:
            end = pending[-1]
            bounds = self._system.enclose(left.t, left.numbers, end.t, end.numbers)[i]
            undecided, upper = _may_cross(bounds, sign, left, end, i)
            min_width = min(min_width, bounds[1] - bounds[0])
            is_short, is_exhausted = (
                end.t - left.t <= min_interval,
                undecided and count >= max_count,
            )
            crosses = self._is_true(i, sign * float(end.values[i]))
            if undecided and not is_short and not is_exhausted:
                pending.append(self.evaluate(left.t + (end.t - left.t) / 2))
                count += 1
                continue
            excess = upper - max(sign * left.values[i], sign * end.values[i])
            missed = undecided and not crosses and excess > _MISS_TOLERANCE * min_width
            if is_exhausted or missed:
                self.missed_crossing = self.missed_crossing or (i, left.t)
            if crosses:
                return self._bisect(i, sign, left.t, end.t)
            left = pending.pop()
        return None

    def _is_true(self, i: int, value: float) -> bool:
        return value > 0 or (value == 0 and i < self._system.calls.n_events)

    def _bisect(self, i: int, sign: float, left: float, right: float) -> float:
        while left < (middle := left + (right - left) / 2) < right:
            if self._is_true(
                i, sign * float(self._evaluate_conditions(middle, self._dense(middle))[i])
            ):
                right = middle
            else:
                left = middle
        return right


def _may_cross(
    bounds: Array, sign: float, left: ConditionValues, right: ConditionValues, i: int
) -> tuple[bool, float]:
    """True if there may be a crossing besides one at the right end; upper bound of the value.

    `bounds` (4,) are those of the value and of its slope (low, high, low, high).
    """
    _, high, min_slope, max_slope = bounds if sign > 0 else -bounds[[1, 0, 3, 2]]
    a, b, h = sign * left.values[i], sign * right.values[i], right.t - left.t
    if np.isfinite(min_slope) and np.isfinite(max_slope) and max_slope > min_slope:
        peak = (b - a - min_slope * h) / (max_slope - min_slope)
        high = min(high, a + max_slope * min(max(peak, 0.0), h))
    if b >= 0:
        return not min_slope >= 0, float(high)
    return not (high < 0 or min_slope >= 0 or max_slope <= 0), float(high)


#: Consecutive crossings after which a chattering switch is ignored, and the longest time between
#: them, relative to the run.
_MAX_CROSSINGS, _CHATTER_TIME = 50, 2.0**-42

#: Steps between checks of progress, and expected remaining steps at which a run is given up.
_CHECK_INTERVAL, _MAX_REMAINING_STEPS = 1024, 1e10

#: Part of the time to a switch that a step shortened for it covers.
_SHORTENED = 1.0 - 2.0**-10


def shortened_step_end(start: float, switch: float) -> float:
    """End time (s) of a step from `start` that must end shortly before a switch."""
    return start + _SHORTENED * (switch - start)


class ProgressCheck:
    """Check that a run from `start` to `end` (s) advances fast enough to end at all."""

    def __init__(self, start: float, end: float) -> None:
        self.end, self._last_time, self._attempts = end, start, 0

    def can_reach_end(self, t: float) -> bool:
        """True if the run can reach its end; call at every attempted step."""
        self._attempts += 1
        if self._attempts % _CHECK_INTERVAL:
            return True
        advance, self._last_time = t - self._last_time, t
        return (self.end - t) * _CHECK_INTERVAL <= _MAX_REMAINING_STEPS * advance


class Crossings:
    """Crossings of `n` switches in a run of `span` s; `is_watched` (n,) excludes chattering
    ones."""

    def __init__(self, n: int, span: float) -> None:
        self.n, self.span, self.count, self.repeat_count = n, span, 0, 0
        self.chatter: tuple[int, float] | None = None
        self._last = np.full(n, -np.inf)
        self.is_watched = np.ones(n, dtype=bool)

    def is_short(self, time: float) -> bool:
        """True if a time in s is negligible in this run."""
        return time <= _CHATTER_TIME * self.span

    def note(self, switch: int, t: float) -> None:
        """Record a crossing at t; stop watching a switch that chatters."""
        is_repeated = self.is_short(t - self._last[switch])
        self._last[switch] = t
        self.count += 1
        self.repeat_count = self.repeat_count + 1 if is_repeated else 0
        if self.repeat_count >= _MAX_CROSSINGS:
            self.repeat_count, self.chatter = 0, (switch, t)
            self.is_watched[switch] = False
