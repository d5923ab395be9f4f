"""Bounce events: derivatives of their event functions by time, coordinates and positions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from mstmm.errors import SceneError
from mstmm.ir import Port
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph, Node
from mstmm.ir.statements import Element
from mstmm.ir.tape import Tape, compile_tape
from mstmm.scene import Event, Scene

from ..coordinate_layout import Layout
from ..expression_tapes import condition_value, inputs_port, resolver, state_ports, values_kernel

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
