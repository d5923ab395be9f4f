"""Crossings of switches, and whether an end is in sight, in a run that is driven from Python; the C
loop keeps its own."""

from __future__ import annotations

import numpy as np

#: Crossings in a row in hardly any time, as part of the run, after which a switch is left alone.
_MOST, _AT_ONCE = 50, 2.0**-42

#: Steps between looks at how the run gets on, and steps that have no end in sight.
_SOME, _NO_END = 1024, 1e10

#: A step that a switch cuts ends behind this part of the way to it.
_JUST_BEFORE = 1.0 - 2.0**-10


def just_before(start: float, switch: float) -> float:
    """Where a step from `start` is to end, just before a switch."""
    return start + _JUST_BEFORE * (switch - start)


class ProgressCheck:
    """Whether a run from `start` to `end` (s) gets on fast enough to end at all."""

    def __init__(self, start: float, end: float) -> None:
        self.end, self._since, self._attempts = end, start, 0

    def has_end(self, t: float) -> bool:
        """To be asked at every step, made again or not."""
        self._attempts += 1
        if self._attempts % _SOME:
            return True
        gone, self._since = t - self._since, t
        return (self.end - t) * _SOME <= _NO_END * gone


class Crossings:
    """Which of `n` switches are `watched` (n,) in a run of `span` s, and how often they crossed."""

    def __init__(self, n: int, span: float) -> None:
        self.n, self.span, self.count, self.here = n, span, 0, 0
        self.chatter: tuple[int, float] | None = None
        self._last = np.full(n, -np.inf)
        self.watched = np.ones(n, dtype=bool)

    def is_short(self, time: float) -> bool:
        """Is that hardly any time in this run?"""
        return time <= _AT_ONCE * self.span

    def note(self, switch: int, t: float) -> None:
        """One has crossed at t; one that does so without end is no longer watched."""
        at_once = self.is_short(t - self._last[switch])
        self._last[switch] = t
        self.count += 1
        self.here = self.here + 1 if at_once else 0
        if self.here >= _MOST:
            self.here, self.chatter = 0, (switch, t)
            self.watched[switch] = False
