"""Event location within a step of an external integrator.

The same search as that of the C loop (runtime/integrate/c/event_location.c): intervals of the step
are bisected until bounds of a condition and of its slope exclude any further crossing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from .callbacks import Equations

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
