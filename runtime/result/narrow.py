"""Whether the steps of a run have passed over what an expression of the motion does.

A force that is narrow in a coordinate is seen at the stages of steps alone: where these are long
it is passed over, and every estimated error is zero.  Behind a run its path is known, and so is
how narrow a function of a coordinate is along it (`breaks.pace`, with the coordinate in the place
of time): a step that moved on by more than that, across a peak of the function that neither of its
ends shows, has not seen it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.expression.expression import Name
from mstmm.risk import Risk

from ..breaks.acting import acting, owners
from ..breaks.intervals import Interval
from ..breaks.pace import CELLS, Pace, Watched, pace
from ..breaks.view import View
from ..run import second_opinion

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from ..engine.compiled import Compiled
    from ..run.trajectory import Trajectory

#: Part of all it does that a peak must rise by to count.
_PEAK = 0.1

#: Places of a function that are looked at in a narrow part of it, and its peaks.
_PLACES, _PEAKS = 512, 200

#: Steps made again that a run may have without having met a peak between its samples.
_SOME = 2

#: Names of coordinates that are looked at.
_NAMES = 100


def passed_over(model: Compiled, run: Trajectory) -> tuple[Risk, ...]:
    """One row for each expression of which steps have passed over something."""
    found = dict[str, Risk]()
    for what, view, path in islice(_of_motion(model, run), _NAMES):
        moved = _moved(run, np.diff(path))
        place = None if moved is None else _first(view, path, moved, run.settings.step is not None)
        if place is not None:
            found.setdefault(what, _risk(what, view.variable, *place))
    return tuple(found.values())


def _risk(what: str, name: str, place: float, way: float, longest: float) -> Risk:
    return Risk(
        "narrow-load", what,
        f"{what} does something near {name} = {place:.6g}, narrower than {longest:.2g}, that steps "
        f"of up to {way:.2g} there have passed over",
        f"write it within where({name} > a, where({name} < b, ..., 0), 0) with a and b close "
        "around it, where steps end, or give max_step", way, float(longest),
    )  # fmt: skip


# --- names and paths ------------------------------------------------------------------------------


def _of_motion(model: Compiled, run: Trajectory) -> Iterator[tuple[str, View, Array]]:
    """Whatever acts and reads coordinates: what it is, as a function of one of them, and the path
    of that."""
    for one in acting(model.scene):
        if one.condition or one.spring is not None or one.expression.depends_on_time_only:
            continue
        constants = dict(one.constants)
        for own in owners(one, model.scene.hinges):
            for name in one.expression.names:
                path = _path(model, run, name, own)
                if path is not None:
                    yield one.what, View(one.expression, constants, variable=name.text), path


def _path(model: Compiled, run: Trajectory, name: Name, own: Hinge | None) -> Array | None:
    """Values of a coordinate at the start, the samples and the end; None for other names.  What is
    narrow in a speed does nothing while the speed passes it."""
    hinge = name.hinge or ("" if own is None else own.name)
    if name.quantity != "q" or not hinge:
        return None
    first, last = run.q[0], run.q[-1]
    if run.settings.output_times is not None and run.start is not None and run.last is not None:
        first, last = run.start[0], run.last[1]
    place = model.layout.hinges[hinge].q + (name.index or 0)
    return np.concatenate([first[None], run.q, last[None]])[:, place]


def _moved(run: Trajectory, ways: Array) -> Array | None:
    """How far a step went on each of these ways, at most; None where that is not known."""
    settings, counted = run.settings, run.statistics
    if settings.output_times is None:
        return np.abs(ways)
    longest = settings.step if settings.step is not None else counted.largest_step
    others = settings.method in second_opinion.METHODS
    if longest is None or (settings.step is None and (counted.rejected > _SOME or others)):
        return None  # steps that met something were made again, shorter, nobody knows where
    ends = (settings.t_start, settings.t_end if run.last is None else run.last[0])
    spent = np.diff(np.concatenate([ends[:1], run.t, ends[1:]]))
    parts = np.divide(longest, spent, out=np.ones(len(spent)), where=spent > longest)
    return np.asarray(np.abs(ways) * parts)


# --- peaks ----------------------------------------------------------------------------------------


def _first(view: View, path: Array, moved: Array, fixed: bool) -> tuple[float, float, float] | None:
    """(where, how far steps went there, how far they should) of the first peak passed over."""
    low, high = float(path.min()), float(path.max())
    watched = view.watched()
    if not np.isfinite(path).all() or not high > low or not watched:
        return None
    known = pace(view.terms, watched, low, high, view.most)
    narrow = known.longest < moved.max(initial=0.0)
    if not narrow.any():
        return None
    for one in watched:
        places, values, longest = _peaks(view, one, known, narrow, high)
        ends = _values(view, one, path)
        for place, value, limit in zip(places, values, longest, strict=True):
            least, most = np.minimum(path[1:], path[:-1]), np.maximum(path[1:], path[:-1])
            steps = (least <= place) & (place <= most) & (moved > limit)
            if not fixed:  # steps that are chosen grow short where their ends show it
                hidden = np.abs(value - ends)
                all_of_it = np.ptp(np.append(values, ends))
                steps &= np.minimum(hidden[1:], hidden[:-1]) > _PEAK * all_of_it
            if steps.any():
                return place, float(moved[steps].max()), limit
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
    at, limit = np.concatenate(places), np.concatenate(limits)
    values = _values(view, one, at)
    before, after = np.diff(values)[:-1], np.diff(values)[1:]
    inside = np.flatnonzero(before * after < 0)[:_PEAKS] + 1
    return at[inside], values[inside], limit[inside]


def _values(view: View, one: Watched, at: Array) -> Array:
    bounds = view.terms(Interval(at, at))[one.term].value
    return np.broadcast_to((bounds.lo + bounds.hi) / 2, at.shape)
