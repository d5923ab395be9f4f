"""Variables of expressions along a run: coordinates, speeds, lengths of springs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array, Integers
from mstmm.expression.expression import Name

from ...breaks.acting import Acting
from ...breaks.enclosures import TIME, Enclosure
from ...breaks.intervals import Interval
from ...engine.calls import Probe

if TYPE_CHECKING:
    from mstmm.scene import Hinge

    from ...engine.compiled import Compiled

#: A cubic with slopes r at the ends of h leaves its chord by max |r - chord| h / 4, and its slope
#: those three by half their spread; the rest is room for higher orders.
_MARGIN = 1.5


@dataclass(frozen=True)
class States:
    """Times (n,), ascending, states and memory of a run at its steps, or at some of them."""

    t: Array
    q: Array
    u: Array
    memory: Array


@dataclass(frozen=True)
class Course:
    """A number along a run: its values (n,) at the states, and its rates (n,) there."""

    values: Array
    rates: Array


def courses(
    model: Compiled, states: States, one: Acting, own: Hinge | None
) -> dict[str, Course] | None:
    """What the names of an expression are along a run, by their text; None where one of them is
    not known."""
    constants = dict(one.constants)
    length = None if one.spring is None else _length(model, states, one)
    found = dict[str, Course]()
    for name in one.expression.names:
        if name.text in constants or (own is not None and name.text in own.parameters):
            continue
        course = _course(model, states, name, own, length)
        if course is None:
            return None
        found[name.text] = course
    return found


def _course(
    model: Compiled, states: States, name: Name, own: Hinge | None, length: Course | None
) -> Course | None:
    if name.text == TIME:
        return Course(states.t, np.ones(len(states.t)))
    if name.text in model.packed.channels:
        return _of_input(model, states, name.text)
    if length is not None and name.text in ("q", "u"):
        return length if name.text == "q" else _smooth(states.t, length.rates)
    hinge = name.hinge or ("" if own is None else own.name)
    if name.quantity not in ("q", "u") or not hinge:
        return None
    slots, index = model.layout.hinges[hinge], name.index or 0
    if name.quantity == "u":
        return _smooth(states.t, states.u[:, slots.u + index])
    values = states.q[:, slots.q + index]
    return Course(values, states.u[:, slots.u + index]) if slots.straight else _smooth(
        states.t, values
    )  # fmt: skip


def _smooth(t: Array, values: Array) -> Course:
    """With rates from parabolas through neighbours."""
    if len(t) < 3:
        return Course(values, np.full(len(t), (values[-1] - values[0]) / (t[-1] - t[0])))
    return Course(values, np.gradient(values, t, edge_order=2))


def _of_input(model: Compiled, states: States, name: str) -> Course:
    """An input or signal; one that is held stands still in every step."""
    place = model.packed.system.held.places[list(model.packed.channels).index(name)]
    if place >= 0:
        return Course(states.memory[:, place], np.zeros(len(states.t)))
    channel = model.packed.channels[name]
    return _smooth(states.t, np.array([channel.value(t) for t in states.t.tolist()]))


def _length(model: Compiled, states: States, one: Acting) -> Course:
    """Length of the spring of an expression (m) and its rate (m/s)."""
    engine, spring = model.looped, one.spring
    assert spring is not None
    probes = []
    for reference in (spring.from_, spring.to):
        body, axes, offset = engine.packed.end(reference)
        probes.append(Probe(body, axes, spring.position if body < 0 else offset))
    seen = engine.observe(
        states.t, states.q.copy(), states.u.copy(), states.memory.copy(), probes, parts=("points",)
    )
    apart = seen.points[:, 1, 0:3] - seen.points[:, 0, 0:3]
    moving = seen.points[:, 1, 3:6] - seen.points[:, 0, 3:6]
    length = np.linalg.norm(apart, axis=1)
    return Course(length, (apart * moving).sum(axis=1) / np.where(length > 0, length, 1.0))


def leaves_of(
    t: Array, known: Mapping[str, Course], names: Sequence[str]
) -> Callable[[Interval], Mapping[str, Enclosure]]:
    """Enclosures of names over cells of time (s), none of which lies across one of the times t
    (n,): those of cubics between the states, with some room."""

    def leaves(cells: Interval) -> dict[str, Enclosure]:
        lo, hi = np.broadcast_arrays(cells.lo, cells.hi)
        step = np.clip(np.searchsorted(t, lo, side="right") - 1, 0, len(t) - 2)
        return {name: _enclosed(t, known[name], step, lo, hi) for name in names}

    return leaves


def _enclosed(t: Array, course: Course, step: Integers, lo: Array, hi: Array) -> Enclosure:
    h = t[step + 1] - t[step]
    values = course.values[step], course.values[step + 1]
    rates = course.rates[step], course.rates[step + 1]
    (a, rate_a), (b, rate_b) = (_cubic((at - t[step]) / h, h, *values, *rates) for at in (lo, hi))
    width = hi - lo
    chord = np.divide(b - a, width, out=np.copy(rate_a), where=width > 0)
    away = 0.25 * _MARGIN * width * np.maximum(np.abs(rate_a - chord), np.abs(rate_b - chord))
    low, high = (
        np.minimum.reduce([rate_a, rate_b, chord]),
        np.maximum.reduce([rate_a, rate_b, chord]),
    )
    spread = 0.5 * _MARGIN * (high - low)
    value = Interval(np.minimum(a, b) - away, np.maximum(a, b) + away)
    return Enclosure(value, Interval(low - spread, high + spread))


def _cubic(
    x: Array, h: Array, a: Array, b: Array, rate_a: Array, rate_b: Array
) -> tuple[Array, Array]:
    """Value and slope at x, 0 to 1, of a cubic over h by its values and slopes at both ends."""
    chord = (b - a) / h
    left, right = rate_a - chord, chord - rate_b
    value = a + x * (b - a) + h * x * (1 - x) * ((1 - x) * left + x * right)
    slope = chord + (1 - x) * (1 - 3 * x) * left + x * (2 - 3 * x) * right
    return np.asarray(value), np.asarray(slope)
