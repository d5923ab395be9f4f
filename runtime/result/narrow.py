"""Whether the steps of a run have passed over what an expression of the motion does.

A force that is narrow in a coordinate is seen at the stages of steps alone: where these are long
it is passed over, and every estimated error is zero.  Behind a run its path is known, and so is
how narrow a function of a coordinate is along it (`breaks.pace`, with the coordinate in the place
of time): a step that moved on by more than that, across a peak of the function that neither of its
ends shows, has not seen it.  Where samples are output times the steps are not known; if one may
have passed over something, the run is made once more to see them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.expression.expression import Name
from mstmm.risk import Risk

from ..breaks.acting import acting, owners
from ..breaks.pace import CELLS, Pace, Watched, pace
from ..breaks.view import View
from ..run.execution import Watch, first_run

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

#: Names of coordinates that are looked at.
_NAMES = 100


@dataclass(frozen=True)
class _Path:
    """A coordinate along a run: its values (n,) at the start, the samples and the end; between two
    of them the smallest and the largest, and how far a step went at most, (n - 1,); its unit."""

    ends: Array
    least: Array
    most: Array
    moved: Array
    unit: str


def passed_over(model: Compiled, run: Trajectory) -> tuple[Risk, ...]:
    """One row for each expression of which steps have passed over something."""
    found = _seen(model, run)
    if not found or run.settings.output_times is None or run.settings.step is not None:
        return found
    every = _every_step(model, run)
    return () if every is None else _seen(model, every)


def _seen(model: Compiled, run: Trajectory) -> tuple[Risk, ...]:
    """The same of steps that are known; between output times of the longest that there was."""
    found = dict[str, Risk]()
    for what, view, path in islice(_of_motion(model, run), _NAMES):
        place = _first(view, path, _ends_are_steps(run))
        if place is not None:
            found.setdefault(what, _risk(what, view.variable, path.unit, *place))
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


def _risk(what: str, name: str, unit: str, place: float, way: float, longest: float) -> Risk:
    return Risk(
        "narrow-load", what,
        f"{what} does something near {name} = {place:.6g}, narrower than {longest:.2g}, that steps "
        f"of up to {way:.2g} there have passed over",
        f"write it within where({name} > a, where({name} < b, ..., 0), 0) with a and b close "
        "around it, where steps end, or give max_step", way, longest, unit,
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
                    yield one.what, View(one.expression, constants, variable=name.text), path


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
    """Of a coordinate; None for other names.  What is narrow in a speed does nothing while the
    speed passes it."""
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
    watched = view.watched()
    if not high > low or not watched:
        return None
    known = pace(view.terms, watched, low, high, view.most)
    narrow = known.longest < path.moved.max(initial=0.0)
    if not narrow.any():
        return None
    for one in watched:
        places, values, longest = _peaks(view, one, known, narrow, high)
        ends = view.values(one.term, path.ends)
        for place, value, limit in zip(places, values, longest, strict=True):
            steps = (path.least <= place) & (place <= path.most) & (path.moved > limit)
            if ends_are_steps:
                hidden = np.abs(value - ends)
                all_of_it = np.ptp(np.append(values, ends))
                steps &= np.minimum(hidden[1:], hidden[:-1]) > _PEAK * all_of_it
            if steps.any():
                return place, float(path.moved[steps].max()), limit
    return None


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
    before, after = np.sign(np.diff(values)[:-1]), np.sign(np.diff(values)[1:])
    inside = np.flatnonzero(before * after < 0)[:_PEAKS] + 1
    return at[inside], values[inside], limit[inside]
