"""Map of a run's expressions of time: the times at which steps end, and the longest steps.

A method evaluates a load only at its stages.  All that can be computed of loads in advance is
therefore determined for the whole run: every time at which an expression switches (a comparison,
`sign`, `abs`, `min`, `max`, a pole), and every feature so narrow that a step could miss it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.expression.drive import jump
from mstmm.expression.inputs import Inputs
from mstmm.numbers.pieces import rough
from mstmm.risk import Risk

from .acting import Acting
from .pace import Pace, pace
from .poles import poles
from .roots import roots
from .view import View

#: Fraction of the run within which two times are equal at its ends.
_ROUNDING = 1e-15
#: Maximum number of samples of a controller in a run.
_MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class TimeMap:
    """Times at which steps end, and longest steps.

    Attributes:
        breaks: (n,) s, ascending, from the start to before the end: steps end there.
        starts, longest: (m,) s: from `starts[i]` up to the next one no step exceeds `longest[i]`.
        narrowest: name of the expression that requires the shortest steps.
        pole: the first time (s, a break) at which an effort or a load grows beyond all bounds, so
            that no motion passes, and a sentence that names it.
        notes: findings about expressions that could not be mapped completely.
    """

    breaks: Array
    starts: Array
    longest: Array
    narrowest: str = ""
    pole: tuple[float, str] | None = None
    notes: tuple[Risk, ...] = field(default=())

    def too_long(self, step: float) -> Risk | None:
        """Finding if a fixed step (s) could miss a feature of a load, else None."""
        shortest = float(self.longest.min(initial=np.inf))
        if step <= shortest:
            return None
        at = float(self.starts[np.argmin(self.longest)])
        return Risk(
            "narrow-load", self.narrowest,
            f"the fixed step of {step:g} s is too long for {self.narrowest}, which near "
            f"t = {at:.6g} s requires steps of {shortest:.2g} s: features may be missed",
            f"use a step below {shortest:.2g} s, or omit step", step, shortest, "s",
            before=True,
        )  # fmt: skip


def time_map(
    expressions: Iterable[Acting],
    start: float,
    end: float,
    inputs: Inputs | None = None,
    samples: Iterable[float] = (),
) -> TimeMap:
    """Build the map of all expressions for a run from `start` to `end` (s).

    `inputs` are the inputs that expressions may name; their knots are breaks, as are the multiples
    of the sample times `samples` (s).  Raises SceneError for a drive that jumps during the run.
    """
    if not end > start:
        return TimeMap(np.zeros(0), np.zeros(0), np.zeros(0))
    once = {(e.expression, e.constants, e.drive): e for e in reversed(list(expressions))}
    with np.errstate(all="ignore"):
        found = _mapped(list(reversed(once.values())), start, end, inputs or {})
    sampled = [_multiples(step, start, end) for step in samples]
    if not sampled:
        return found
    breaks = _inside({*found.breaks.tolist(), *np.concatenate(sampled).tolist()}, start, end)
    return replace(found, breaks=breaks)


def _multiples(step: float, start: float, end: float) -> Array:
    """All integer multiples of a step (s) from `start` to `end` (s)."""
    count = (end - start) / step
    if count > _MOST_SAMPLES:
        raise SceneError(
            f"a controller with sample_time = {step:g} s acts {count:.0f} times from t = {start:g} "
            f"to {end:g} s; a run allows at most {_MOST_SAMPLES} samples: split the run"
        )
    first, last = math.floor(start / step), math.ceil(end / step)
    return np.asarray(np.arange(first, last + 1) * step)


def _mapped(expressions: list[Acting], start: float, end: float, inputs: Inputs) -> TimeMap:
    breaks, paces, notes = set[float](), list[tuple[Pace, str]](), list[Risk]()
    ends = list[tuple[float, str]]()
    for one in expressions:
        view = View(one.expression, dict(one.constants), one.drive)
        breaks.update(one.expression.time_breaks())
        breaks.update(knot for name in one.inputs for knot in inputs[name].knots)
        if one.drive:
            knots = sorted({knot for name in one.inputs for knot in rough(inputs[name])})
            jumps = jump(one.expression, _around(knots, start, end), inputs)
            if jumps:
                raise SceneError(f"{one.what}: {_shown(one)} {jumps}")
        acts = not (one.drive or one.condition)
        for margin in view.margins():
            found = roots(margin, start, end, view.most)
            breaks.update(found.gaps.ravel().tolist())
            jumps = jump(one.expression, found.gaps.tolist(), inputs) if one.drive else ""
            if jumps:
                raise SceneError(f"{one.what}: {_shown(one)} {jumps}")
            at_pole, whole = poles(view, found.gaps) if acts else (found.gaps[:0, 0] > 0, False)
            if at_pole.any():
                first = float(found.gaps[np.argmax(at_pole), 0])
                if whole:
                    ends.append((max(first, start), _endless(one)))
                else:
                    notes.append(_pole(one, first))
            if not found.complete:
                notes.append(_many_switches(one, found.open_from))
        watched = view.watched()
        if watched:
            paces.append((pace(view.terms, watched, start, end, view.most), one.what))
            if not paces[-1][0].complete:
                notes.append(_too_fast(one, float(paces[-1][0].longest.min())))
    starts, longest, narrowest = _shortest(paces)
    return TimeMap(
        _inside(breaks, start, end),
        starts,
        longest,
        narrowest,
        min(ends, default=None),
        tuple(dict.fromkeys(notes)),
    )


def _endless(one: Acting) -> str:
    return (
        f"{one.what} ({_shown(one)}) grows beyond all bounds there, too fast for any motion to "
        "pass; end the run before that time, or limit it, such as by min or max"
    )


def _pole(one: Acting, t: float) -> Risk:
    return Risk(
        "pole", one.what,
        f"a part of {one.what} ({_shown(one)}) grows beyond all bounds at t = {t:.6g} s: unless "
        "its factor vanishes there, no motion passes",
        "end the run before that time, or limit the part, such as by min or max", before=True,
    )  # fmt: skip


def _around(knots: list[float], start: float, end: float) -> list[tuple[float, float]]:
    """Floating-point numbers before and after each knot within the run."""
    inner = [knot for knot in knots if start < knot < end]
    return [(math.nextafter(t, -math.inf), math.nextafter(t, math.inf)) for t in inner]


def _inside(times: set[float], start: float, end: float) -> Array:
    """Times within the run, ascending; times that equal the start up to rounding become it."""
    at_start, at_end = start + _ROUNDING * (end - start), end - _ROUNDING * (end - start)
    early = start - _ROUNDING * (end - start)
    found = {start if t <= at_start else t for t in times if early <= t < at_end}
    return np.array(sorted(found))


def _many_switches(one: Acting, since: float) -> Risk:
    return Risk(
        "switches", one.what,
        f"{one.what} ({_shown(one)}) switches too often for a step to end at every switching "
        f"time: from t = {since:.6g} s on some are missed", "give max_step, or a shorter run",
        before=True,
    )  # fmt: skip


def _too_fast(one: Acting, longest: float) -> Risk:
    return Risk(
        "narrow-load", one.what,
        f"{one.what} ({_shown(one)}) changes too often to be examined completely before the "
        f"run; steps stay below {longest:.2g} s where it was not examined", "give max_step",
        before=True,
    )  # fmt: skip


def _shown(one: Acting) -> str:
    text = one.expression.text
    return repr(text if len(text) <= 60 else text[:57] + "...")


def _shortest(paces: list[tuple[Pace, str]]) -> tuple[Array, Array, str]:
    """Combine all step limits; also the name of the expression with the shortest limit."""
    finite = [(p, what) for p, what in paces if np.isfinite(p.longest).any()]
    if not finite:
        return np.zeros(0), np.zeros(0), ""
    starts = np.unique(np.concatenate([p.starts for p, _ in finite]))
    each = [p.longest[np.searchsorted(p.starts, starts, side="right") - 1] for p, _ in finite]
    narrowest = min(finite, key=lambda pair: float(pair[0].longest.min()))[1]
    return starts, np.minimum.reduce(each), narrowest


__all__ = ["TimeMap", "time_map"]
