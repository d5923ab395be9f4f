"""Switching functions (margins) of expressions, which are zero where a branch changes.

Comparisons, `sign`, `abs`, `min` and `max` change branch where their argument, or the difference
of the two, is zero.  If that depends on the motion, a step must end there as at an event.  So even
short intervals between two switches are resolved.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from itertools import islice

from mstmm.expression.expression import SWITCHES, Expression, Name
from mstmm.ir.graph import Graph, Node
from mstmm.ir.tape import Tape
from mstmm.scene import Hinge, Scene, split_reference

from ..discontinuities.active_expressions import (
    ActiveExpression,
    active_expressions,
    examined_hinges,
)
from ..discontinuities.interval_enclosures import terms_of_time
from .coordinate_layout import Layout
from .expression_tapes import Resolver, event_tape, resolver
from .records.bounce_records import Bounce, build_bounces

#: Largest number of margins: each is evaluated several times per step.
MAX_SWITCHES = 1000

#: (body, end) -> number among the ends whose positions and velocities a tape reads.
Probes = dict[tuple[str, str], int]


@dataclass(frozen=True)
class Switch:
    """Margin, and the expression that switches, as the user wrote it."""

    margin: Node
    description: str


@dataclass(frozen=True)
class EventFunctions:
    """Event functions of a scene.

    Attributes:
        tape: values of events and releases, then margins of the first MOST switches; None if there
            are none.
        ends: (body, end) whose positions and velocities the tape reads.
        switches: all switches.
        bounces: events that bounce.
    """

    tape: Tape | None
    ends: tuple[tuple[str, str], ...]
    switches: tuple[Switch, ...]
    bounces: tuple[Bounce, ...] = ()


def event_order(scene: Scene, layout: Layout, held: Collection[str] = ()) -> EventFunctions:
    """Event functions: events in file order, hard stops, releases, then switches.

    `held` are inputs that are set during the run.
    """
    graph, probes = Graph(), Probes()
    switches = state_switches(scene, layout, graph, probes, held)
    conditions: list[tuple[Expression, Hinge | None]] = [(e.when, None) for e in scene.events]
    conditions += [(h.release, h) for h in scene.hinge if h.release is not None]
    if not conditions and not switches:
        return EventFunctions(None, (), ())
    margins = [switch.margin for switch in switches[:MAX_SWITCHES]]
    tape = event_tape(conditions, layout, graph, probes, margins)
    bounces = build_bounces(scene, layout, dict(probes))
    return EventFunctions(tape, tuple(probes), tuple(switches), bounces)


def has_switches(scene: Scene) -> bool:
    """Whether any expression switches with the state."""
    return any(_switching_terms(active) for active in active_expressions(scene))


def state_switches(
    scene: Scene, layout: Layout, graph: Graph, probes: Probes, held: Collection[str]
) -> list[Switch]:
    """Distinct switches that depend on the state, at most MOST + 1.

    Ends whose positions they read are added to `probes`.
    """
    switches: dict[int, Switch] = {}
    for active in active_expressions(scene, held):
        terms = _switching_terms(active)
        for own in islice(examined_hinges(active, scene.hinges), MAX_SWITCHES + 1) if terms else ():
            resolve = resolver(graph, layout, own, probes=probes)
            if active.spring is not None:
                resolve = _with_spring_length(resolve, graph, active, probes)
            nodes = active.expression.nodes(graph, resolve)
            for number in terms:
                term = active.expression.terms[number]
                a, *rest = (nodes[i] for i in term.args)
                margin = a - rest[0] if rest else a
                text = active.expression.text[term.start : term.end]
                if margin.value is None and len(switches) <= MAX_SWITCHES:
                    switches.setdefault(
                        margin.number, Switch(margin, f"{text!r} ({active.description})")
                    )
    return list(switches.values())


def _switching_terms(active: ActiveExpression) -> list[int]:
    """Numbers of the terms that switch with the state.

    Excluded are the comparison of an event's condition itself, and terms of inputs that are
    constant within a step.
    """
    expression, constants = active.expression, dict(active.constants)
    of_time = set(terms_of_time(expression, constants)[0])
    if active.held_inputs:
        order, moving = terms_of_time(
            expression, constants | dict.fromkeys(active.held_inputs, 0.0)
        )
        of_time |= set(order) - set(moving)
    return [
        number
        for number in sorted(expression.required_terms - of_time)
        if expression.terms[number].op in SWITCHES
        and not (active.condition and number == expression.root)
    ]


def _with_spring_length(
    resolve: Resolver, graph: Graph, active: ActiveExpression, probes: Probes
) -> Callable[[Name], Node]:
    """Resolver for a spring's effort: `q` is the length and `u` its rate, from the ends."""
    spring = active.spring
    assert spring is not None

    def components(reference: str) -> list[Node]:
        """Position and velocity (6) of an end."""
        if split_reference(reference)[0] == "ground":
            return [graph.constant(x) for x in (*spring.position, 0.0, 0.0, 0.0)]
        number = probes.setdefault(split_reference(reference), len(probes))
        return [graph.element("points", 6 * number + k) for k in range(6)]

    ends = [components(reference) for reference in (spring.from_, spring.to)]
    d = [b - a for a, b in zip(*ends, strict=True)]
    length = graph.call("sqrt", d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    rate = (d[0] * d[3] + d[1] * d[4] + d[2] * d[5]) / length

    def resolve_spring(name: Name) -> Node:
        nodes = {"q": length, "u": rate}
        return nodes[name.parts[0]] if name.parts[0] in nodes else resolve(name)

    return resolve_spring
