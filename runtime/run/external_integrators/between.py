"""Where conditions become true between two looks at a step of another integrator.

The same search as that of the C loop (runtime/integrate/c/event_location.c): parts of the step are
halved until bounds of a condition and of its slope leave nothing open.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from .callbacks import Equations

#: A part of a step is looked at so often at most, until something may have passed unseen and from
#: then on; it is no shorter than this part of the one between two looks, and a condition that has
#: not come closer to values nearby is narrow.
_MOST, _FEW, _FINEST, _NARROW = 2000, 64, 2.0**-40, 1e-6

#: Half the way over which slopes of the dense output are taken, as part of the step.
_ASIDE = 1e-5


@dataclass(frozen=True)
class Look:
    """What is watched at a time (s): the values, and the numbers that the conditions read."""

    t: float
    values: Array
    seen: Any


class Between:
    """Conditions of `system` within one step from `start` to `end` (s).

    `dense` gives its states, `watched` the values of conditions at them.  `unseen` is the first
    condition that may have passed unseen, and when (s).
    """

    def __init__(
        self, system: Equations, watched: Callable[[float, Array], Array],
        dense: Callable[[float], Array], start: float, end: float,
        unseen: tuple[int, float] | None,
    ) -> None:  # fmt: skip
        self._system, self._watched, self._dense = system, watched, dense
        self._start, self._end = start, end
        self.unseen = unseen

    def look(self, t: float) -> Look:
        """All that is watched at a time of the step."""
        y = self._dense(t)
        aside = max(_ASIDE * (self._end - self._start), 8 * math.ulp(t))
        before, after = max(t - aside, self._start), min(t + aside, self._end)
        rates = (self._dense(after) - self._dense(before)) / ((after - before) or 1.0)
        values = self._watched(t, y)  # which is what `see` looks at
        return Look(t, values, self._system.see(t, y, rates))

    def first(self, i: int, sign: float, left: Look, right: Look) -> float | None:
        """A time (s) shortly behind the first at which number i, by this sign, is above zero, of an
        event also zero; None where it nowhere is between left and right.  It is not at left."""
        waiting, taken, first_width = [right], 0, math.inf
        most = _MOST if self.unseen is None else _FEW
        finest = max(4 * math.ulp(max(abs(left.t), abs(right.t))), _FINEST * (right.t - left.t))
        while waiting:
            to = waiting[-1]
            bounds = self._system.enclose(left.t, left.seen, to.t, to.seen)[i]
            open_, highest = _judge(bounds, sign, left, to, i)
            first_width = min(first_width, bounds[1] - bounds[0])
            closed, enough = to.t - left.t <= finest, open_ and taken >= most
            crosses = self._holds(i, sign, to)
            if open_ and not closed and not enough:
                waiting.append(self.look(left.t + (to.t - left.t) / 2))
                taken += 1
                continue
            above = highest - max(sign * left.values[i], sign * to.values[i])
            if enough or (open_ and not crosses and above > _NARROW * first_width):
                self.unseen = self.unseen or (i, left.t)
            if crosses:
                return self._located(i, sign, left.t, to.t)
            left = waiting.pop()
        return None

    def _holds(self, i: int, sign: float, at: Look) -> bool:
        value = sign * float(at.values[i])
        return value > 0 or (value == 0 and i < self._system.calls.n_events)

    def _located(self, i: int, sign: float, left: float, right: float) -> float:
        while left < (middle := left + (right - left) / 2) < right:
            value = sign * float(self._watched(middle, self._dense(middle))[i])
            if value > 0 or (value == 0 and i < self._system.calls.n_events):
                right = middle
            else:
                left = middle
        return right


def _judge(bounds: Array, sign: float, left: Look, right: Look, i: int) -> tuple[bool, float]:
    """Whether more than one crossing, or any besides that at the right end, may lie between; and
    the highest value there."""
    _, high, falling, rising = bounds if sign > 0 else -bounds[[1, 0, 3, 2]]
    a, b, h = sign * left.values[i], sign * right.values[i], right.t - left.t
    if np.isfinite(falling) and np.isfinite(rising) and rising > falling:
        at = (b - a - falling * h) / (rising - falling)
        high = min(high, a + rising * min(max(at, 0.0), h))
    if b >= 0:
        return not falling >= 0, float(high)
    return not (high < 0 or falling >= 0 or rising <= 0), float(high)
