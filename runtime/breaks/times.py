"""What a run must know of its expressions of time before it starts: where its steps end, and how
long they may be.

A method sees a load only at its stages.  Whatever can be known of loads beforehand is therefore
looked for over the whole run: every time at which an expression switches (a comparison, `sign`,
`abs`, `min`, `max`, a pole), and every part so narrow that a step could pass over it.
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

#: Part of the run within which two times are one at its ends.
_ROUNDING = 1e-15
#: Samples of a controller that a run takes at most.
_MOST_SAMPLES = 1_000_000


@dataclass(frozen=True)
class TimeMap:
    """Where steps end and how long they may be.

    Attributes:
        breaks: (n,) s, ascending, from the start to before the end: steps end there.
        starts, longest: (m,) s: from `starts[i]` on, up to the next, no step is longer.
        narrowest: what asks for the shortest steps.
        pole: the first time (s, a break) at which an effort or a load grows beyond all bounds, so
            that no motion passes, and which one does, in words.
        notes: what could not be mapped.
    """

    breaks: Array
    starts: Array
    longest: Array
    narrowest: str = ""
    pole: tuple[float, str] | None = None
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
            f"take a step below {shortest:.2g} s, or leave step out", step, shortest, "s",
            before=True,
        )  # fmt: skip


def time_map(
    expressions: Iterable[Acting],
    start: float,
    end: float,
    inputs: Inputs | None = None,
    samples: Iterable[float] = (),
) -> TimeMap:
    """The map of all expressions for a run from `start` to `end` (s); `inputs` are what they may
    name, whose knots are breaks, `samples` times (s) whose multiples are.

    Raises SceneError for a drive that jumps on the way.
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
    """All whole multiples of a step (s) from `start` to `end`."""
    count = (end - start) / step
    if count > _MOST_SAMPLES:
        raise SceneError(
            f"a controller with sample_time = {step:g} s acts {count:.0f} times from t = {start:g} "
            f"to {end:g} s; a run takes {_MOST_SAMPLES} samples at most: make it in parts"
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
        "pass; end the run before, or bound it, such as by min or max"
    )


def _pole(one: Acting, t: float) -> Risk:
    return Risk(
        "pole", one.what,
        f"a part of {one.what} ({_shown(one)}) grows beyond all bounds at t = {t:.6g} s: unless "
        "what it multiplies vanishes there, no motion passes",
        "end the run before, or bound the part, such as by min or max", before=True,
    )  # fmt: skip


def _around(knots: list[float], start: float, end: float) -> list[tuple[float, float]]:
    """The numbers before and after each knot within the run."""
    inner = [knot for knot in knots if start < knot < end]
    return [(math.nextafter(t, -math.inf), math.nextafter(t, math.inf)) for t in inner]


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


__all__ = ["TimeMap", "time_map"]
