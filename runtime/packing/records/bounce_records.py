"""Events that bounce -> slopes of their values by time, coordinates and places."""

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

#: Numbers of an end among those that events read: its place, then its velocity.
_NUMBERS, _PLACE = 6, 3


@dataclass(frozen=True)
class Bounce:
    """How event number `event` throws back.

    `slopes` is a tape like that of the events, which gives the slope of the value by time and by
    each of `places`: (coordinate, speed), or (-1 - 3 number of the end - component, 0).
    """

    event: int
    restitution: float
    slopes: Tape
    places: tuple[tuple[int, int], ...]


def build_bounces(
    scene: Scene, layout: Layout, probes: dict[tuple[str, str], int]
) -> tuple[Bounce, ...]:
    """Bounces in the order of the events; `probes` are all ends whose places these read.

    Raises SceneError for conditions of speeds, and of coordinates whose rates are no speeds.
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
            places.append(_place(layout, event, leaf.leaf))
            slopes.append(derivative(value, {leaf: 1}))
    if not places:
        raise SceneError(
            f'event "{event.name}": its condition reads no place, so nothing bounces; name a '
            "coordinate (pin.q) or a place (ball.y)"
        )
    ports = [*state_ports(layout), Port("points", (_NUMBERS * len(probes),)), inputs_port(layout)]
    kernel = values_kernel(graph, "bounce", ports, [derivative(value, {time: 1}), *slopes])
    return Bounce(number, event.restitution, compile_tape(kernel), tuple(places))


def _place(layout: Layout, event: Event, leaf: Element) -> tuple[int, int]:
    index = int(leaf.index[0])
    if leaf.port == "points" and index % _NUMBERS < _PLACE:
        return -1 - _PLACE * (index // _NUMBERS) - index % _NUMBERS, 0
    if leaf.port == "q":
        bent = {one.q for one in layout.modal.values()}
        for slots in layout.owners:
            if slots.q <= index < slots.q + slots.nq and slots.straight and slots.q not in bent:
                return index, slots.u + index - slots.q
    raise SceneError(
        f'event "{event.name}": do = "bounce" strikes places, coordinates of hinges whose rates '
        f"are speeds among them, found {event.when.text!r}; write a condition of places such as "
        "ball.y <= 0.1"
    )


def _leaves(value: Node) -> Iterator[Node]:
    """Entries of arrays that a value is made of, each once."""
    seen, stack = set[int](), [value]
    while stack:
        node = stack.pop()
        if node.number in seen:
            continue
        seen.add(node.number)
        stack.extend(node.args)
        if node.op == "element":
            yield node
