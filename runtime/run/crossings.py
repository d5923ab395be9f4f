"""Crossings of switches, and whether an end is in sight, in a run that is driven from Python; the C
loop keeps its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mstmm.arrays import Array

#: Crossings in a row in hardly any time, as part of the run, after which a switch is left alone.
_MOST, _AT_ONCE = 50, 2.0**-42

#: Steps between looks at how the run gets on, and steps that have no end in sight.
_SOME, _NO_END = 1024, 1e10

#: A step that a switch cuts ends behind this part of the way to it.
_JUST_BEFORE = 1.0 - 2.0**-10


def just_before(start: float, switch: float) -> float:
    """Where a step from `start` is to end, just before a switch."""
    return start + _JUST_BEFORE * (switch - start)


def dip(value: Callable[[float], float], t: list[float], v: list[float]) -> float | None:
    """A time at which a function that is above zero at three times lies below it, if parabolas
    through the lowest of its values lead there; else None."""
    for _ in range(4):
        if not np.isfinite(v).all():
            return None
        slopes = np.diff(v) / np.diff(t)
        bend = (slopes[1] - slopes[0]) / (t[2] - t[0])
        if not bend > 0:
            return None
        x = float((t[0] + t[1]) / 2 - slopes[0] / (2 * bend))
        lowest = v[1] + (x - t[1]) * (slopes[0] + bend * (x - t[0]))
        if not t[0] < x < t[2] or x == t[1] or 2 * lowest > max(v) - lowest:
            return None
        found = value(x)
        if found < 0:
            return x
        rows = sorted([*zip(t, v, strict=True), (x, found)])
        middle = min(range(1, 3), key=lambda k: rows[k][1])
        t, v = ([row[k] for row in rows[middle - 1 : middle + 2]] for k in (0, 1))
    return None


class Sight:
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
    """Which of `n` switches are watched in a run of `span` s, and how often they crossed."""

    def __init__(self, n: int, span: float) -> None:
        self.n, self.span, self.count, self.here = n, span, 0, 0
        self.chatter: tuple[int, float] | None = None
        self._last = np.full(n, -np.inf)
        self._watched = np.ones(n, dtype=bool)

    def changed(self, before: Array, after: Array) -> list[int]:
        """Switches whose margins have other signs now."""
        opposite = np.sign(before) * np.sign(after) < 0
        return np.flatnonzero(self._watched & opposite).tolist()

    def near(self, rows: list[Array]) -> list[int]:
        """Switches whose margins keep their sign and are smallest in the middle of three rows."""
        a, b, c = rows
        same = (np.sign(a) == np.sign(b)) & (np.sign(b) == np.sign(c)) & (b != 0) & self._watched
        return np.flatnonzero(same & (np.abs(b) <= np.minimum(np.abs(a), np.abs(c)))).tolist()

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
            self._watched[switch] = False
