"""Variables of expressions along a run: coordinates, speeds, lengths of springs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.expression.expression import Name

from ..discontinuities.active_expressions import ActiveExpression
from ..discontinuities.interval_enclosures import TIME, Enclosure, Interval

if TYPE_CHECKING:
    from mstmm.scene import Hinge, Spring

    from ..engine.compiled_scene import CompiledScene

#: A cubic with slopes r at the ends of h deviates from its chord by max |r - chord| h / 4, and its
#: slope exceeds those three by half their spread; the rest is a margin for higher orders.
_HIGHER_ORDER_MARGIN = 1.5


@dataclass(frozen=True)
class RunStates:
    """Times (n,), ascending, states and memory of a run at all or some of its steps."""

    t: Array
    q: Array
    u: Array
    memory: Array


@dataclass(frozen=True)
class SampledVariable:
    """Variable along a run: its values (n,) and rates (n,) at the states."""

    values: Array
    rates: Array


def sampled_variables(
    model: CompiledScene, states: RunStates, active: ActiveExpression, own: Hinge | None
) -> dict[str, SampledVariable] | None:
    """Variables of an expression along a run, by name; None if one of them is unknown."""
    constants = dict(active.constants)
    spring = active.spring
    length = None if spring is None else _spring_length(model, states, spring)
    variables = dict[str, SampledVariable]()
    for name in active.expression.names:
        if name.text in constants or (own is not None and name.text in own.parameters):
            continue
        course = _sampled_variable(model, states, name, own, length)
        if course is None:
            return None
        variables[name.text] = course
    return variables


def _sampled_variable(
    model: CompiledScene,
    states: RunStates,
    name: Name,
    own: Hinge | None,
    length: SampledVariable | None,
) -> SampledVariable | None:
    if name.text == TIME:
        return SampledVariable(states.t, np.ones(len(states.t)))
    if name.text in model.packed_scene.channels:
        return _sampled_input(model, states, name.text)
    if length is not None and name.text in ("q", "u"):
        return length if name.text == "q" else _with_parabola_rates(states.t, length.rates)
    hinge = name.hinge or ("" if own is None else own.name)
    if name.quantity not in ("q", "u") or not hinge:
        return None
    slots, index = model.coordinate_layout.hinges[hinge], name.index or 0
    if name.quantity == "u":
        return _with_parabola_rates(states.t, states.u[:, slots.u + index])
    values = states.q[:, slots.q + index]
    return (
        SampledVariable(values, states.u[:, slots.u + index])
        if slots.rates_are_speeds
        else _with_parabola_rates(states.t, values)
    )


def _with_parabola_rates(t: Array, values: Array) -> SampledVariable:
    """Variable with rates from parabolas through neighbours."""
    if len(t) < 3:
        return SampledVariable(values, np.full(len(t), (values[-1] - values[0]) / (t[-1] - t[0])))
    return SampledVariable(values, np.gradient(values, t, edge_order=2))


def _sampled_input(model: CompiledScene, states: RunStates, name: str) -> SampledVariable:
    """Input or signal along a run; a held input is constant in every step."""
    slot = model.packed_scene.system.held_inputs.memory_indices[
        list(model.packed_scene.channels).index(name)
    ]
    if slot >= 0:
        return SampledVariable(states.memory[:, slot], np.zeros(len(states.t)))
    channel = model.packed_scene.channels[name]
    return _with_parabola_rates(states.t, np.array([channel.value(t) for t in states.t.tolist()]))


def _spring_length(model: CompiledScene, states: RunStates, spring: Spring) -> SampledVariable:
    """Length of a spring (m) and its rate (m/s), 0 where its ends coincide."""
    arrays = (np.ascontiguousarray(x) for x in (states.t, states.q, states.u, states.memory))
    length, rate = model.looped.spring_motion(spring, *arrays)
    return SampledVariable(length, np.where(length > 0, rate, 0.0))


def make_enclosures(
    t: Array, known: Mapping[str, SampledVariable], names: Sequence[str]
) -> Callable[[Interval], Mapping[str, Enclosure]]:
    """Enclosures of names over cells of time (s).

    They are those of cubics between the states, with a margin. No cell may contain one of the times
    t (n,) in its interior.
    """

    def leaves(cells: Interval) -> dict[str, Enclosure]:
        lo, hi = np.broadcast_arrays(cells.lo, cells.hi)
        step = np.clip(np.searchsorted(t, lo, side="right") - 1, 0, len(t) - 2)
        return {name: _enclosure_in_steps(t, known[name], step, lo, hi) for name in names}

    return leaves


def _enclosure_in_steps(
    t: Array, course: SampledVariable, step: Integers, lo: Array, hi: Array
) -> Enclosure:
    h = t[step + 1] - t[step]
    values = course.values[step], course.values[step + 1]
    rates = course.rates[step], course.rates[step + 1]
    (a, rate_a), (b, rate_b) = (
        _cubic_value_and_slope((end_time - t[step]) / h, h, *values, *rates)
        for end_time in (lo, hi)
    )
    width = hi - lo
    chord = np.divide(b - a, width, out=np.copy(rate_a), where=width > 0)
    value_margin = (
        0.25
        * _HIGHER_ORDER_MARGIN
        * width
        * np.maximum(np.abs(rate_a - chord), np.abs(rate_b - chord))
    )
    low, high = (
        np.minimum.reduce([rate_a, rate_b, chord]),
        np.maximum.reduce([rate_a, rate_b, chord]),
    )
    spread = 0.5 * _HIGHER_ORDER_MARGIN * (high - low)
    value = Interval(np.minimum(a, b) - value_margin, np.maximum(a, b) + value_margin)
    return Enclosure(value, Interval(low - spread, high + spread))


def _cubic_value_and_slope(
    x: Array, h: Array, a: Array, b: Array, rate_a: Array, rate_b: Array
) -> tuple[Array, Array]:
    """Value and slope at x, 0 to 1, of a cubic over h from values and slopes at both ends."""
    chord = (b - a) / h
    left, right = rate_a - chord, chord - rate_b
    value = a + x * (b - a) + h * x * (1 - x) * ((1 - x) * left + x * right)
    slope = chord + (1 - x) * (1 - 3 * x) * left + x * (2 - 3 * x) * right
    return np.asarray(value), np.asarray(slope)
