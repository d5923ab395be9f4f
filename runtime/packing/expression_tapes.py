"""Kernels and tapes of a scene's expressions over t, q, u and inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.expression.derivatives import INPUTS, input_node, motion
from mstmm.expression.expression import Expression, Name
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

#: Port of the numbers that carry derivatives.
MOVING = "moving"
SeedPorts = Sequence[Port]


class Values:
    """Values of expressions at (t, q, u); equal expressions share one index."""

    def __init__(self, layout: Layout, moving: SeedPorts = ()) -> None:
        self.layout, self._seed_ports = layout, moving
        self._graph = Graph()
        self._nodes: list[Node] = []
        self._indices: dict[int, int] = {}

    def value_index(self, expression: Expression, own: Hinge | None = None) -> int:
        """Index of the expression's value, which is added if it is new; -1 for constant zero."""
        if expression.is_zero:
            return -1
        node = expression.build(self._graph, resolver(self._graph, self.layout, own))
        if node.number not in self._indices:
            self._indices[node.number] = len(self._nodes)
            self._nodes.append(node)
        return self._indices[node.number]

    def __len__(self) -> int:
        return len(self._nodes)

    def kernel(self) -> KernelIR:
        """Kernel (t, q, u, inputs) -> all values."""
        inputs = [*state_ports(self.layout), inputs_port(self.layout), *self._seed_ports]
        return values_kernel(self._graph, "values", inputs, self._nodes)


def state_ports(layout: Layout) -> list[Port]:
    """Ports t, q and u."""
    return [Port("t", (1,)), Port("q", (layout.nq,)), Port("u", (layout.nu,))]


def inputs_port(layout: Layout) -> Port:
    """Port of the inputs and signals: the pieces of `mstmm.numerics.piecewise_polynomial` at t."""
    return Port(INPUTS, (NUMBERS_PER_PIECE * len(layout.inputs),))


def resolver(
    graph: Graph,
    layout: Layout,
    own: Hinge | None = None,
    length: bool = False,
    probes: dict[tuple[str, str], int] | None = None,
) -> Resolver:
    """Function that builds the graph node of a name.

    Names are t, inputs, q and u of hinges, parameters of the hinge `own`, with `length` those of a
    spring, and positions and velocities of ends, which are numbered in `probes`.
    """

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
            _check_index(name, hinge, index, slots.q_names if quantity == "q" else slots.u_names)
            return graph.element(quantity, first + index)
        if quantity in CURVE_QUANTITIES and name.owner:
            slots, port = layout.curve_slots(name.owner), "qu"[CURVE_QUANTITIES.index(quantity)]
            return graph.element(port, getattr(slots, port))
        if quantity in ("q", "u") and length:
            return graph.element("length", 0 if quantity == "q" else 1)
        if own is not None and quantity in own.parameters:
            return graph.constant(own.parameters[quantity])
        assert probes is not None, name.text
        parts = (name.parts[0], name.parts[1] if len(name.parts) == 3 else "")
        component = ("x", "y", "z", "vx", "vy", "vz").index(quantity)
        return graph.element("points", 6 * probes.setdefault(parts, len(probes)) + component)

    return resolve


def _check_index(name: Name, owner: str, index: int, entries: Sequence[str]) -> None:
    """Raise SceneError if an index is too large.

    It is checked here because "auto" chooses the number of shapes only after validation.
    """
    if index >= len(entries):
        raise SceneError(
            f"{name.text!r}: {owner!r} has {len(entries)} entries: {', '.join(entries) or 'none'}"
        )


def values_kernel(graph: Graph, name: str, inputs: Sequence[Port], nodes: list[Node]) -> KernelIR:
    """Kernel whose only output, "values", holds the nodes."""
    output = Port("values", (len(nodes),))
    return graph.kernel(name, inputs, [output], {"values": nodes})


def drive_kernel(drives: Sequence[Expression], layout: Layout, moving: SeedPorts = ()) -> KernelIR:
    """Kernel (t, inputs) -> position, speed and acceleration of every drive."""
    graph = Graph()
    time, resolve = graph.element("t", 0), resolver(graph, layout)
    nodes = [node for drive in drives for node in motion(drive, time, resolve)]
    return values_kernel(graph, "drives", [Port("t", (1,)), inputs_port(layout), *moving], nodes)


def effort_kernel(effort: Expression, layout: Layout, moving: SeedPorts = ()) -> KernelIR:
    """Kernel (t, q, u, [length, rate], inputs) -> effort of a spring."""
    graph = Graph()
    node = effort.build(graph, resolver(graph, layout, length=True))
    inputs = [*state_ports(layout), Port("length", (2,)), inputs_port(layout), *moving]
    return values_kernel(graph, "effort", inputs, [node])


def constant_kernel(name: str, system: System, numbers: Sequence[float]) -> KernelIR:
    """Kernel with constant values and the ports of the kernel `name` ("effort" or "values")."""
    graph = Graph()
    ports = [Port("t", (1,)), Port("q", (system.nq,)), Port("u", (system.nu,))]
    ports += [Port("length", (2,))] if name == "effort" else []
    ports += [Port(INPUTS, (NUMBERS_PER_PIECE * len(system.inputs),))]
    return values_kernel(graph, name, ports, [graph.constant(float(value)) for value in numbers])


def condition_value(condition: Expression, graph: Graph, resolve: Resolver) -> Node:
    """Difference of the two sides of a comparison; >= 0 where it holds."""
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
    """Tape of event functions, >= 0 where their condition holds, followed by the margins.

    Its inputs are t, q, u, positions and velocities of the ends in `probes`, and inputs.
    """
    nodes = []
    for condition, own in conditions:
        resolve = resolver(graph, layout, own, probes=probes)
        nodes.append(condition_value(condition, graph, resolve))
    inputs = [*state_ports(layout), Port("points", (6 * len(probes),)), inputs_port(layout)]
    return compile_tape(values_kernel(graph, "events", inputs, [*nodes, *margins]))
