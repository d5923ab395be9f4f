"""What a run must know of its expressions of time before it starts: where its steps end, and how
long they may be.

A method sees a load only at its stages.  Whatever can be known of loads beforehand is therefore
looked for over the whole run: every time at which an expression switches (a comparison, `sign`,
`abs`, `min`, `max`, a pole), and every part so narrow that a step could pass over it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.expression.drive import jump
from mstmm.expression.parser import Term
from mstmm.risk import Risk

from .acting import Acting
from .enclosures import Enclosure, enclose, of_time
from .intervals import EVERYTHING, Interval, cos
from .pace import Pace, Watched, pace
from .roots import Margin, roots

#: Part of the run within which two times are one at its ends.
_ROUNDING = 1e-15

#: Cells of an expression at most, and terms in all of them together.
_CELLS, _WORK = 2**16, 2**18

_DIFFERENCES = frozenset({"lt", "le", "gt", "ge", "min", "max"})
_FUNCTIONS = frozenset({
    "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "log",
    "sqrt", "pow", "div",
})  # fmt: skip


@dataclass(frozen=True)
class TimeMap:
    """Where steps end and how long they may be.

    Attributes:
        breaks: (n,) s, ascending, from the start to before the end: steps end there.
        starts, longest: (m,) s: from `starts[i]` on, up to the next, no step is longer.
        narrowest: what asks for the shortest steps.
        notes: what could not be mapped.
    """

    breaks: Array
    starts: Array
    longest: Array
    narrowest: str = ""
    notes: tuple[Risk, ...] = field(default=())

    def too_long(self, step: float) -> Risk | None:
        """A fixed step that could pass over what a load does; None if it could not."""
        shortest = float(self.longest.min(initial=np.inf))
        if step <= shortest:
            return None
        at = float(self.starts[np.argmin(self.longest)])
        return Risk(
            "narrow-load", self.narrowest,
            f"the fixed step of {step:g} s is too long for {self.narrowest}, which near "
            f"t = {at:.6g} s asks for steps of {shortest:.2g} s: what it does may be missed",
            f"take a step below {shortest:.2g} s, or leave step out", step, shortest, before=True,
        )  # fmt: skip


def time_map(expressions: Iterable[Acting], start: float, end: float) -> TimeMap:
    """The map of all expressions for a run from `start` to `end` (s).

    Raises SceneError for a drive that jumps on the way.
    """
    if not end > start:
        return TimeMap(np.zeros(0), np.zeros(0), np.zeros(0))
    once = {(e.expression, e.constants, e.drive): e for e in reversed(list(expressions))}
    with np.errstate(all="ignore"):
        return _mapped(list(reversed(once.values())), start, end)


def _mapped(expressions: list[Acting], start: float, end: float) -> TimeMap:
    breaks, paces, notes = set[float](), list[tuple[Pace, str]](), list[Risk]()
    for one in expressions:
        view = _View(one)
        breaks.update(one.expression.time_breaks())
        for margin in view.margins():
            found = roots(margin, start, end, view.most)
            breaks.update(found.gaps.ravel().tolist())
            jumps = jump(one.expression, found.gaps.tolist()) if one.drive else ""
            if jumps:
                raise SceneError(f"{one.what}: {_shown(one)} {jumps}")
            if not found.complete:
                notes.append(_many_switches(one, found.open_from))
        watched = view.watched()
        if watched:
            paces.append((pace(view.terms, watched, start, end, view.most), one.what))
            if not paces[-1][0].complete:
                notes.append(_too_fast(one, float(paces[-1][0].longest.min())))
    starts, longest, narrowest = _shortest(paces)
    return TimeMap(
        _inside(breaks, start, end), starts, longest, narrowest, tuple(dict.fromkeys(notes))
    )


def _inside(times: set[float], start: float, end: float) -> Array:
    """Ascending; what lies at the start but for rounding is the start, which is a break then."""
    at_start, at_end = start + _ROUNDING * (end - start), end - _ROUNDING * (end - start)
    early = start - _ROUNDING * (end - start)
    found = {start if t <= at_start else t for t in times if early <= t < at_end}
    return np.array(sorted(found))


def _many_switches(one: Acting, since: float) -> Risk:
    return Risk(
        "switches", one.what,
        f"{one.what} ({_shown(one)}) switches too often for every switching to end a step: from "
        f"t = {since:.6g} s on some are passed over", "give max_step, or a shorter run",
        before=True,
    )  # fmt: skip


def _too_fast(one: Acting, longest: float) -> Risk:
    return Risk(
        "narrow-load", one.what,
        f"{one.what} ({_shown(one)}) changes too often for all of it to be looked at before the "
        f"run; steps are kept below {longest:.2g} s where it is not known", "give max_step",
        before=True,
    )  # fmt: skip


def _shown(one: Acting) -> str:
    text = one.expression.text
    return repr(text if len(text) <= 60 else text[:57] + "...")


def _shortest(paces: list[tuple[Pace, str]]) -> tuple[Array, Array, str]:
    """All paces as one, and what asks for the shortest step."""
    finite = [(p, what) for p, what in paces if np.isfinite(p.longest).any()]
    if not finite:
        return np.zeros(0), np.zeros(0), ""
    starts = np.unique(np.concatenate([p.starts for p, _ in finite]))
    each = [p.longest[np.searchsorted(p.starts, starts, side="right") - 1] for p, _ in finite]
    narrowest = min(finite, key=lambda pair: float(pair[0].longest.min()))[1]
    return starts, np.minimum.reduce(each), narrowest


class _View:
    """One expression as functions over cells of time."""

    def __init__(self, one: Acting) -> None:
        self.expression = one.expression
        self.constants: Mapping[str, float] = dict(one.constants)
        self.drive = one.drive
        self.order, moving = of_time(one.expression, self.constants)
        self.moving = frozenset(moving)
        self.most = min(_CELLS, _WORK // max(1, len(self.order)))

    def terms(self, t: Interval) -> dict[int, Enclosure]:
        """Enclosures of all terms that depend on t alone."""
        return enclose(self.expression.terms, self.order, self.constants, t)

    def watched(self) -> list[Watched]:
        """The functions that could be narrow: all but sums, products and switches; of a drive,
        whose second derivative acts, their slopes too."""
        found = []
        for number in sorted(self.moving):
            term = self.expression.terms[number]
            if term.op == "div" and term.args[1] not in self.moving:
                continue
            if term.op in _FUNCTIONS:
                turning = term.op in ("sin", "cos")
                argument = term.args[0] if turning else None
                found.append(Watched(number, argument))
                if self.drive:
                    found.append(Watched(number, argument, slope=True))
        return found

    def margins(self) -> list[Margin]:
        """What changes its sign where the expression switches; straight lines are known exactly."""
        lines, terms = self.expression.linear_switches(), self.expression.terms
        once: dict[tuple[bool, str], Margin] = {}
        for number in sorted(self.moving - set(lines)):
            term = terms[number]
            margin = self._margin(term)
            if margin is not None:
                text = [self.expression.text[terms[i].start : terms[i].end] for i in term.args]
                key = " - ".join(text if term.op in _DIFFERENCES else text[term.op == "div" :][:1])
                once.setdefault((term.op == "tan", key), margin)
        return list(once.values())

    def _margin(self, term: Term) -> Margin | None:
        op, args = term.op, term.args
        if op in _DIFFERENCES:
            return self._of(args, lambda a, b: a - b)
        if op in ("sign", "abs", "log", "sqrt", "atan2"):
            return self._of(args[:1], lambda a: a)
        if op == "div" and args[1] in self.moving:
            return self._of(args[1:], lambda a: a)
        if op == "tan":
            return self._of(args, lambda a: Enclosure(cos(a.value), EVERYTHING))
        if op == "pow" and args[0] in self.moving and not self._is_whole(args[1]):
            return self._of(args[:1], lambda a: a)
        return None

    def _is_whole(self, exponent: int) -> bool:
        value = self.expression.terms[exponent].constant
        return value is not None and value >= 0 and value == int(value)

    def _of(self, args: tuple[int, ...], difference: Callable[..., Enclosure]) -> Margin:
        needed = self._below(args)
        terms, constants = self.expression.terms, self.constants

        def margin(t: Interval) -> Enclosure:
            known = enclose(terms, needed, constants, t)
            with np.errstate(all="ignore"):
                return difference(*(known[i] for i in args))

        return margin

    def _below(self, args: tuple[int, ...]) -> list[int]:
        found, waiting = set[int](), list(args)
        while waiting:
            number = waiting.pop()
            if number not in found:
                found.add(number)
                waiting += self.expression.terms[number].args
        return sorted(found)


__all__ = ["TimeMap", "time_map"]
