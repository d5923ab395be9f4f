"""Detection of narrow features that the steps of a run missed.

A force that is narrow in a coordinate is seen at the stages of steps alone: where these are long
it is passed over, and every estimated error is zero.  Behind a run its path is known, and so is
how narrow a function of a coordinate is along it (`breaks.pace`, with the coordinate in the place
of time): a step that moved on by more than that, across a peak of the function that neither of its
ends shows, has not seen it.  What reads speeds, several coordinates, or the length of a spring is
looked at along the run's time instead.  Where samples are output times the steps are not known; if
one may have passed over something, the run is made once more to see them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.expression.expression import Expression, Name
from mstmm.risk import Risk

from ..breaks.acting import Acting, acting, owners
from ..breaks.enclosures import TIME, Enclosure
from ..breaks.intervals import Interval
from ..breaks.pace import CELLS, Pace, Watched, pace
from ..breaks.view import View
from ..run.execution import Watch, first_run
from .owners.paths import Course, States, courses, leaves_of

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from ..engine.compiled import Compiled
    from ..run.trajectory import Trajectory

#: Part of all it does that a peak must rise by to count.
_PEAK = 0.1

#: Places of a function that are looked at in a narrow part of it, and its peaks.
_PLACES, _PEAKS = 512, 200

#: Steps up to which a run is made again to see all of them.
_STEPS = 20_000

#: Expressions by coordinates that are looked at.
_NAMES = 100

#: A step that was chosen is longer than what it has passed over along time by this factor at
#: least: what speeds and several coordinates do together is wider than the bounds of it.
_CLEAR = 3.0

#: A peak along time counts from this part of all that a function does around the motion.
_FAINT = 1e-9

#: Steps of a run that are looked at together over time, and cells of them.
_PIECE, _CELLS = 2**12, 2**15


@dataclass(frozen=True)
class _Path:
    """A coordinate, or time, along a run: its values (n,) at the start, the samples and the end;
    between two of them the smallest and the largest, and how far a step went at most, (n - 1,); its
    unit.  `ranges` are how far functions of time go in the whole run, by their terms: such ones are
    known between neighbours of `ends` alone."""

    ends: Array
    least: Array
    most: Array
    moved: Array
    unit: str
    ranges: Mapping[int, float] = field(default_factory=dict)


def passed_over(model: Compiled, run: Trajectory) -> tuple[Risk, ...]:
    """Findings about expressions with narrow features that steps missed."""
    found = _seen(model, run)
    if run.settings.output_times is None or run.settings.step is not None:
        return found
    if not found and not _hides(model, run):
        return ()
    every = _every_step(model, run)
    return () if every is None else _seen(model, every)


def _seen(model: Compiled, run: Trajectory) -> tuple[Risk, ...]:
    """The same of steps that are known; between output times of the longest that there was."""
    found = dict[str, Risk]()
    looked_at = chain(_of_motion(model, run), _over_time(model, run))
    for what, view, path in islice(looked_at, _NAMES):
        place = _first(view, path, _ends_are_steps(run))
        if place is not None:
            found.setdefault(what, _risk(what, view.variable, path, *place))
    return tuple(found.values())


def _ends_are_steps(run: Trajectory) -> bool:
    """Whether samples are where steps ended that were chosen, short where something is seen."""
    return run.settings.output_times is None and run.settings.step is None


def _every_step(model: Compiled, run: Trajectory) -> Trajectory | None:
    """The run once more, as far as it came, with all its steps as samples; None if that takes long,
    or does not lead there again."""
    if run.statistics.steps > _STEPS:
        return None
    _, q, u = run.first
    t_end = run.settings.t_end if run.last is None else run.last[0]
    settings = replace(run.settings, t_end=t_end, output_times=None)
    again = first_run(model, settings, q, u, Watch(None, settings))
    return replace(again, start=(q, u)) if again.is_comparable else None


def _risk(what: str, name: str, path: _Path, place: float, way: float, longest: float) -> Risk:
    remedy = f"give max_step = {longest:.1g}, or less"
    if not path.ranges:
        remedy = (
            f"write it within where({name} > a, where({name} < b, ..., 0), 0) with a and b close "
            "around it, where steps end, or give max_step"
        )
    return Risk(
        "narrow-load", what,
        f"{what} does something near {name} = {place:.6g}, narrower than {longest:.2g}, that steps "
        f"of up to {way:.2g} there have passed over", remedy, way, longest, path.unit,
    )  # fmt: skip


# --- names and paths ------------------------------------------------------------------------------


def _of_motion(model: Compiled, run: Trajectory) -> Iterator[tuple[str, View, _Path]]:
    """Whatever acts and reads coordinates: what it is, as a function of one of them, and the path
    of that."""
    parts = _parts(run)
    if parts is None:
        return
    for one in acting(model.scene):
        if one.condition or one.spring is not None or one.expression.depends_on_time_only:
            continue
        constants = dict(one.constants)
        for own in owners(one, model.scene.hinges):
            for name in one.expression.names:
                path = _path(model, run, parts, name, own)
                if path is not None:
                    yield one.what, View(one.expression, constants, names=(name.text,)), path


def _over_time(model: Compiled, run: Trajectory) -> Iterator[tuple[str, View, _Path]]:
    """Whatever acts and reads speeds, several names or a length, as a function of time; a long run
    in pieces."""
    states = _distinct(run)
    if states is None:
        return
    longest = _longest(run)
    for one, own, constants, names in _of_several(model):
        known = courses(model, states, one, own)
        if known is not None:
            order = (TIME, *(name for name in names if name != TIME))
            whole = View(one.expression, constants, False, order, leaves_of(states.t, known, names))
            ranges = _ranges(whole, states.t, {name: known[name] for name in names})
            for first in range(0, len(states.t) - 1, _PIECE):
                t = states.t[first : first + _PIECE + 1]
                part = {
                    name: Course(x.values[first : first + _PIECE + 1],
                                 x.rates[first : first + _PIECE + 1])
                    for name, x in known.items()
                }  # fmt: skip
                moved = np.minimum(np.diff(t), longest)
                view = View(one.expression, constants, False, order, leaves_of(t, part, names))
                yield one.what, view, _Path(t, t[:-1], t[1:], moved, "s", ranges)


def _peaked(view: View) -> list[Watched]:
    """What may have peaks; an angle only jumps, where it passes half a turn."""
    terms = view.expression.terms
    return [one for one in view.watched() if terms[one.term].op != "atan2"]


def _ranges(view: View, t: Array, known: Mapping[str, Course]) -> dict[int, float]:
    """How far functions of an expression go, by their terms: at the times t (n,), and a small part
    of that around the motion."""
    found = dict[int, float]()
    around = _around(view.expression, view.constants, known)
    for term in {view.expression.root, *(one.term for one in _peaked(view))}:
        values, width = view.values(term, t), around[term].value.width
        finite = values[np.isfinite(values)]
        found[term] = float(np.ptp(finite)) if len(finite) else 0.0
        if np.isfinite(width).all():
            found[term] = max(found[term], _FAINT * float(width.max()))
    return found


def _around(
    expression: Expression, constants: Mapping[str, float], known: Mapping[str, Course]
) -> dict[int, Enclosure]:
    """Bounds of all terms of an expression around a motion."""
    box = {name: _anywhere(course) for name, course in known.items()}
    view = View(expression, constants, names=(TIME, *known), leaves=lambda _: box)
    return view.terms(Interval(np.zeros(1), np.zeros(1)))


def _of_several(
    model: Compiled,
) -> Iterator[tuple[Acting, Hinge | None, dict[str, float], list[str]]]:
    """Whatever acts, may have peaks, and reads more than a coordinate: with its hinge, constants
    and names."""
    for one in acting(model.scene):
        if one.condition or one.drive or one.expression.depends_on_time_only:
            continue
        for own in islice(owners(one, model.scene.hinges), _NAMES):
            constants = dict(one.constants) | ({} if own is None else dict(own.parameters))
            names = [n.text for n in one.expression.names if n.text not in constants]
            alone = len(names) == 1 and one.spring is None
            coordinate = alone and one.expression.names[0].quantity == "q"
            if not coordinate and _peaked(View(one.expression, constants, names=names or [TIME])):
                yield one, own, constants, names


def _hides(model: Compiled, run: Trajectory) -> bool:
    """Whether what reads speeds or several names may be so narrow, for all that its samples tell,
    that steps between them have passed over it."""
    states, longest = _distinct(run), _longest(run)
    if states is None or np.diff(states.t).max() <= 2 * longest:
        return False
    for one, own, constants, names in _of_several(model):
        known = courses(model, states, one, own)
        if known is None:
            continue
        terms = _around(one.expression, constants, known)
        for watched in _peaked(View(one.expression, constants, names=names)):
            found = terms[watched.term]
            slope = np.maximum(np.abs(found.slope.lo), np.abs(found.slope.hi))
            if not (slope * longest <= 2 * found.value.width).all():
                return True
    return False


def _anywhere(course: Course) -> Enclosure:
    """All values and rates that a number has along a run, with half as much room around."""
    bounds = []
    for x in (course.values, course.rates):
        room = 0.25 * np.ptp(x)
        bounds.append(Interval(np.array([x.min() - room]), np.array([x.max() + room])))
    return Enclosure(*bounds)


def _distinct(run: Trajectory) -> States | None:
    """States of a run at times that differ, the last of each; None where there is no way."""
    t, q, u = _states(run)
    memory = run.memory
    if run.start is not None and run.last is not None and len(memory):
        memory = np.concatenate([memory[:1], memory, memory[-1:]])
    if len(t) < 2 or len(memory) != len(t) or not (np.isfinite(q).all() and np.isfinite(u).all()):
        return None
    last = np.append(np.diff(t) > 0, True)
    return States(t[last], q[last], u[last], memory[last]) if last.sum() > 1 else None


def _longest(run: Trajectory) -> float:
    """No step between two samples is longer than this, s."""
    settings = run.settings
    if settings.output_times is None:
        return np.inf
    longest = settings.step if settings.step is not None else run.statistics.largest_step
    return np.inf if longest is None else longest


def _states(run: Trajectory) -> tuple[Array, Array, Array]:
    """(t, q, u) at the start, the samples and the end."""
    t, q, u = run.t, run.q, run.u
    if run.start is not None and run.last is not None:
        (end, *last), first = run.last, (run.settings.t_start, *run.start)
        rows = zip(first, (t, q, u), (end, *last), strict=True)
        t, q, u = (np.concatenate([np.asarray(a)[None], x, np.asarray(b)[None]])
                   for a, x, b in rows)  # fmt: skip
    return t, q, u


def _parts(run: Trajectory) -> Array | None:
    """Part of the way between two of these states that one step went, at most; None where there is
    no way."""
    settings, (t, q, _) = run.settings, _states(run)
    if len(t) < 2 or not np.isfinite(q).all():
        return None
    spent = np.diff(t)
    longest = settings.step if settings.step is not None else run.statistics.largest_step
    if settings.output_times is None or longest is None:
        return np.ones(len(spent))
    return np.divide(longest, spent, out=np.ones(len(spent)), where=spent > longest)


def _path(
    model: Compiled, run: Trajectory, parts: Array, name: Name, own: Hinge | None
) -> _Path | None:
    """Of a coordinate; None for other names."""
    hinge = name.hinge or ("" if own is None else own.name)
    if name.quantity != "q" or not hinge:
        return None
    slots, index = model.layout.hinges[hinge], name.index or 0
    t, q, u = _states(run)
    ends = q[:, slots.q + index]
    between = np.stack([ends[:-1], ends[1:]])
    if slots.straight:
        between = _cubic(np.diff(t), ends, u[:, slots.u + index])
    way = np.abs(np.diff(between, axis=0)).sum(axis=0)
    return _Path(ends, between.min(axis=0), between.max(axis=0), parts * way, slots.q_units[index])


def _cubic(h: Array, ends: Array, rates: Array) -> Array:
    """(7, n - 1) values between ends (n,) that are h (n - 1,) apart, those among them; of cubics
    with these rates."""
    x = np.linspace(0.0, 1.0, 7)[:, None]
    a, b, va, vb = ends[:-1], ends[1:], h * rates[:-1], h * rates[1:]
    return np.asarray(a + x * (b - a) + x * (1 - x) * ((1 - x) * (va - b + a) + x * (b - a - vb)))


# --- peaks ----------------------------------------------------------------------------------------


def _first(view: View, path: _Path, ends_are_steps: bool) -> tuple[float, float, float] | None:
    """(where, how far steps went there, how far they should) of the first peak passed over."""
    low, high = float(path.least.min()), float(path.most.max())
    watched = _peaked(view) if path.ranges else view.watched()
    if not high > low or not watched:
        return None
    edges = path.ends if path.ranges else None
    most = _CELLS if path.ranges else view.most
    known = pace(view.terms, watched, low, high, most, edges)
    narrow = known.longest < path.moved.max(initial=0.0)
    if not narrow.any():
        return None
    root = view.expression.root
    for one in watched:
        places, values, longest = _peaks(view, one, known, narrow, high)
        ends = view.values(one.term, path.ends)
        for place, value, limit in zip(places, values, longest, strict=True):
            long = path.moved > (_CLEAR if path.ranges and ends_are_steps else 1.0) * limit
            steps = (path.least <= place) & (place <= path.most) & long
            if ends_are_steps or path.ranges:
                all_of_it = max(np.ptp(np.append(values, ends)), path.ranges.get(one.term, 0.0))
                steps &= _hidden(value, ends, ends_are_steps) > _PEAK * all_of_it
            if path.ranges and steps.any():  # a part that is narrow may do nothing to the whole
                whole = view.values(root, np.append(path.ends, place))
                steps &= _hidden(whole[-1], whole[:-1], ends_are_steps) > _PEAK * path.ranges[root]
            if steps.any():
                return place, float(path.moved[steps].max()), limit
    return None


def _hidden(value: float, ends: Array, both: bool) -> Array:
    """(n - 1,) how far a value is from those at the ends (n,) of steps: from both, or from one."""
    apart = np.abs(value - ends)
    return np.asarray((np.minimum if both else np.maximum)(apart[1:], apart[:-1]))


def _peaks(
    view: View, one: Watched, known: Pace, narrow: Array, high: float
) -> tuple[Array, Array, Array]:
    """Peaks of a function in its narrow parts: where, how high, and how far a step may go there."""
    ends = np.append(known.starts[1:], high)
    places, limits = [np.zeros(0)], [np.zeros(0)]
    parts = (known.starts, ends, known.longest)
    for a, b, longest in zip(*(part[narrow] for part in parts), strict=True):
        count = int(min(np.ceil(2 * CELLS * (b - a) / longest), _PLACES)) + 2
        places.append(np.linspace(a, b, count))
        limits.append(np.full(count, longest))
    at, once = np.unique(np.concatenate(places), return_index=True)  # where parts meet
    limit = np.concatenate(limits)[once]
    values = view.values(one.term, at)
    ways = np.sign(np.diff(values))
    moving = np.flatnonzero(np.abs(ways) > 0)  # between places of equal height it has turned, too
    inside = moving[1:][np.diff(ways[moving]) != 0][:_PEAKS]
    return at[inside], values[inside], limit[inside]
