"""Switch crossings and progress of runs that Python steps; the C loop has its own code."""

from __future__ import annotations

import numpy as np

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
