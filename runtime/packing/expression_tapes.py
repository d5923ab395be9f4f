"""Expressions of a scene -> tapes over t, q, u and inputs: efforts, loads, drives, events."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.expression.drive import motion
from mstmm.expression.expression import Expression, Name
from mstmm.expression.inputs import INPUTS, input_node
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.tape import Tape, compile_tape
from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE
from mstmm.scene import Hinge
from mstmm.scene.checks.expression_names import CURVE_QUANTITIES

from .coordinate_layout import Layout

if TYPE_CHECKING:
    from .system import System

Resolver = Callable[[Name], Node]

#: Inputs that stand for numbers which carry derivatives.
MOVING = "moving"
Moving = Sequence[Port]


class Values:
    """Numbers that expressions give at (t, q, u): each is asked for once and known by its place."""

    def __init__(self, layout: Layout, moving: Moving = ()) -> None:
        self.layout, self._moving = layout, moving
        self._graph = Graph()
        self._nodes: list[Node] = []
        self._places: dict[int, int] = {}

    def place(self, expression: Expression, own: Hinge | None = None) -> int:
        """Place of the expression's value; -1 for the constant zero."""
        if expression.is_zero:
            return -1
        node = expression.build(self._graph, resolver(self._graph, self.layout, own))
        if node.number not in self._places:
            self._places[node.number] = len(self._nodes)
            self._nodes.append(node)
        return self._places[node.number]

    def __len__(self) -> int:
        return len(self._nodes)

    def kernel(self) -> KernelIR:
        """t (1), q, u, inputs -> the values in the order of their places."""
        inputs = [*state_ports(self.layout), inputs_port(self.layout), *self._moving]
        return values_kernel(self._graph, "values", inputs, self._nodes)


def state_ports(layout: Layout) -> list[Port]:
    """Inputs of every tape that reads the state."""
    return [Port("t", (1,)), Port("q", (layout.nq,)), Port("u", (layout.nu,))]


def inputs_port(layout: Layout) -> Port:
    """The numbers of all inputs and signals at t: see `mstmm.numerics.piecewise_polynomial`."""
    return Port(INPUTS, (NUMBERS_PER_PIECE * len(layout.inputs),))


def resolver(
    graph: Graph,
    layout: Layout,
    own: Hinge | None = None,
    length: bool = False,
    probes: dict[tuple[str, str], int] | None = None,
) -> Resolver:
    """Nodes of names: t, inputs, q and u of hinges, parameters, a spring's length, positions."""

    def resolve(name: Name) -> Node:
        quantity, index = name.quantity, name.index or 0
        if name.text == "t":
            return graph.element("t", 0)
        if name.text in layout.inputs:
            return input_node(layout.inputs[name.text], graph.element("t", 0))
        if quantity in ("q", "u") and (name.hinge or own is not None):
            hinge = name.hinge or (own.name if own else "")
            slots = layout.hinges[hinge]
            first = slots.q if quantity == "q" else slots.u
            _refuse_beyond(name, hinge, index, slots.q_names if quantity == "q" else slots.u_names)
            return graph.element(quantity, first + index)
        if quantity in CURVE_QUANTITIES and name.owner:
            way, kind = layout.along(name.owner), "qu"[CURVE_QUANTITIES.index(quantity)]
            return graph.element(kind, getattr(way, kind))
        if quantity in ("q", "u") and length:
            return graph.element("length", 0 if quantity == "q" else 1)
        if own is not None and quantity in own.parameters:
            return graph.constant(own.parameters[quantity])
        assert probes is not None, name.text
        parts = (name.parts[0], name.parts[1] if len(name.parts) == 3 else "")
        component = ("x", "y", "z", "vx", "vy", "vz").index(quantity)
        return graph.element("points", 6 * probes.setdefault(parts, len(probes)) + component)

    return resolve


def _refuse_beyond(name: Name, owner: str, index: int, entries: Sequence[str]) -> None:
    """How many shapes a flexible body has is known only here where `"auto"` chose them."""
    if index >= len(entries):
        raise SceneError(
            f"{name.text!r}: {owner!r} has {len(entries)} entries: {', '.join(entries) or 'none'}"
        )


def values_kernel(graph: Graph, name: str, inputs: Sequence[Port], nodes: list[Node]) -> KernelIR:
    """A kernel with nodes as its one output, "values"."""
    output = Port("values", (len(nodes),))
    return graph.kernel(name, inputs, [output], {"values": nodes})


def drive_kernel(drives: Sequence[Expression], layout: Layout, moving: Moving = ()) -> KernelIR:
    """t, inputs -> position, speed and acceleration of every drive."""
    graph = Graph()
    time, resolve = graph.element("t", 0), resolver(graph, layout)
    nodes = [node for drive in drives for node in motion(drive, time, resolve)]
    return values_kernel(graph, "drives", [Port("t", (1,)), inputs_port(layout), *moving], nodes)


def effort_kernel(effort: Expression, layout: Layout, moving: Moving = ()) -> KernelIR:
    """t, q, u, [length, rate], inputs -> effort of a spring."""
    graph = Graph()
    node = effort.build(graph, resolver(graph, layout, length=True))
    inputs = [*state_ports(layout), Port("length", (2,)), inputs_port(layout), *moving]
    return values_kernel(graph, "effort", inputs, [node])


def constant_kernel(name: str, system: System, numbers: Sequence[float]) -> KernelIR:
    """(t, q, u, [length, rate], inputs) -> the same numbers always."""
    graph = Graph()
    ports = [Port("t", (1,)), Port("q", (system.nq,)), Port("u", (system.nu,))]
    ports += [Port("length", (2,))] if name == "effort" else []
    ports += [Port(INPUTS, (NUMBERS_PER_PIECE * len(system.inputs),))]
    return values_kernel(graph, name, ports, [graph.constant(float(value)) for value in numbers])


def condition_value(condition: Expression, graph: Graph, resolve: Resolver) -> Node:
    """Difference of what a comparison compares; >= 0 where it holds."""
    comparison = condition.comparison
    assert comparison is not None, condition.text
    left, sign, right = comparison
    difference = left.build(graph, resolve) - right.build(graph, resolve)
    return difference if sign in (">", ">=") else -difference


def event_tape(
    conditions: Sequence[tuple[Expression, Hinge | None]],
    layout: Layout,
    graph: Graph,
    probes: dict[tuple[str, str], int],
    margins: Sequence[Node],
) -> Tape:
    """t, q, u, positions of the ends in `probes`, inputs -> g per condition, g >= 0 where it holds,
    and behind them the margins."""
    nodes = []
    for condition, own in conditions:
        resolve = resolver(graph, layout, own, probes=probes)
        nodes.append(condition_value(condition, graph, resolve))
    inputs = [*state_ports(layout), Port("points", (6 * len(probes),)), inputs_port(layout)]
    return compile_tape(values_kernel(graph, "events", inputs, [*nodes, *margins]))
