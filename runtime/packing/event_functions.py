"""Event functions: events, releases, switching functions (margins), and slopes of bounces.

Comparisons, `sign`, `abs`, `min` and `max` change branch where their argument, or the difference
of the two, is zero.  If that depends on the motion, a step must end there as at an event.  So even
short intervals between two switches are resolved.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from itertools import islice

from mstmm.errors import SceneError
from mstmm.expression.expression import SWITCHES, Expression, Name
from mstmm.ir import Port
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph, Node
from mstmm.ir.statements import Element
from mstmm.ir.tape import Tape, compile_tape
from mstmm.scene import Event, Hinge, Scene, split_reference

from ..discontinuities.active_expressions import (
    ActiveExpression,
    active_expressions,
    examined_hinges,
)
from ..discontinuities.interval_enclosures import terms_of_time
from .coordinate_layout import Layout
from .expression_tapes import (
    Resolver,
    condition_value,
    event_tape,
    inputs_port,
    resolver,
    state_ports,
    values_kernel,
)

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


# --- bounces --------------------------------------------------------------------------------------

#: Numbers of an end that events read: its position (3), then its velocity (3).
_NUMBERS, _POSITION = 6, 3


@dataclass(frozen=True)
class Bounce:
    """Bounce of event number `event`.

    `slopes` is a tape with the inputs of the event tape: the derivative of the event function by
    time and by each of `places`: (coordinate, speed), or (-1 - 3 number of the end - component, 0).
    """

    event: int
    restitution: float
    slopes: Tape
    places: tuple[tuple[int, int], ...]


def build_bounces(
    scene: Scene, layout: Layout, probes: dict[tuple[str, str], int]
) -> tuple[Bounce, ...]:
    """Build the bounces in the order of the events; `probes` are all ends that these read.

    Raises SceneError for conditions on speeds, and on coordinates whose rates are not speeds.
    """
    return tuple(
        _bounce(scene, layout, probes, number, event)
        for number, event in enumerate(scene.events) if event.restitution is not None
    )  # fmt: skip


def _bounce(
    scene: Scene, layout: Layout, probes: dict[tuple[str, str], int], number: int, event: Event
) -> Bounce:
    assert event.restitution is not None
    graph = Graph()
    value = condition_value(event.when, graph, resolver(graph, layout, probes=probes))
    time, places, slopes = graph.element("t", 0), list[tuple[int, int]](), list[Node]()
    for leaf in _leaves(value):
        assert isinstance(leaf.leaf, Element)
        if leaf.leaf.port in ("q", "u", "points"):
            places.append(_position_reference(layout, event, leaf.leaf))
            slopes.append(derivative(value, {leaf: 1}))
    if not places:
        raise SceneError(
            f'event "{event.name}": do = "bounce" needs a condition on a coordinate (pin.q) or '
            f"position (ball.y), found {event.when.text!r}"
        )
    ports = [*state_ports(layout), Port("points", (_NUMBERS * len(probes),)), inputs_port(layout)]
    kernel = values_kernel(graph, "bounce", ports, [derivative(value, {time: 1}), *slopes])
    return Bounce(number, event.restitution, compile_tape(kernel), tuple(places))


def _position_reference(layout: Layout, event: Event, leaf: Element) -> tuple[int, int]:
    """Entry of `Bounce.places` for an input of the event function."""
    index = int(leaf.index[0])
    if leaf.port == "points" and index % _NUMBERS < _POSITION:
        return -1 - _POSITION * (index // _NUMBERS) - index % _NUMBERS, 0
    if leaf.port == "q":
        modal = {slots.q for slots in layout.modal.values()}
        for slots in layout.owners:
            if (
                slots.q <= index < slots.q + slots.nq
                and slots.rates_are_speeds
                and slots.q not in modal
            ):
                return index, slots.u + index - slots.q
    raise SceneError(
        f'event "{event.name}": do = "bounce" needs a condition on positions, or on hinge '
        f"coordinates whose rates are speeds, found {event.when.text!r}; write a condition on "
        "positions such as ball.y <= 0.1"
    )


def _leaves(value: Node) -> Iterator[Node]:
    """Array elements that a value depends on, without duplicates."""
    seen, stack = set[int](), [value]
    while stack:
        node = stack.pop()
        if node.number in seen:
            continue
        seen.add(node.number)
        stack.extend(node.args)
        if node.op == "element":
            yield node
