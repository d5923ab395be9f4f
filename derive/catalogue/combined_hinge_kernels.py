"""Kernels of a hinge that combine its own kernel with the generic steps of the sweep.

Those kernels are evaluated on one graph, where zeros and ones of the hinge's motion fold and sines
are shared: no new derivation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache

from mstmm.ir import Guard, KernelIR, Port
from mstmm.ir.differentiation import derivatives
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Inliner, Nodes, element_nodes

from ..equations import riccati_sweep
from ..equations import tangent_hinge_elimination as hinge_tangent
from ..lower.kernel_lowering import lower

#: Outputs of the hinge kernel that have a directional derivative in the generic steps.
_CHANGED_OUTPUTS = ("H", "v", "w", "c")


def across_kernels(hinge: KernelIR) -> Iterator[KernelIR]:
    """`body_motion` of a hinge, and `directions` if it has speeds, from its kernel "hinge"."""
    yield body_motion(hinge)
    if _port_length(hinge, "u"):
        yield directions(hinge)


def body_motion(hinge: KernelIR) -> KernelIR:
    """Motion across a hinge and of the outboard body (`forward_generic`)."""
    forward = _forward_kernel(_port_length(hinge, "u"))
    graph = Graph()
    nodes = _hinge_nodes(graph, hinge, guarded=True)
    more = [port for port in forward.inputs if port.name not in nodes]
    body_nodes = Inliner(graph).run(
        forward, nodes | {p.name: element_nodes(graph, p) for p in more}
    )
    outputs = [*hinge.outputs, *forward.outputs]
    return graph.kernel(
        "body_motion", (*hinge.inputs, *more), outputs,
        _nested_values(outputs, nodes | body_nodes),
        purpose="motion across the hinge and of its outboard body", sources=hinge.sources,
    )  # fmt: skip


def directions(hinge: KernelIR) -> KernelIR:
    """B, G, W and H of all unknowns of a hinge without prescribed motion (`tangent_column`).

    Coordinates change with unknown k by row k of `along`, or by 1 / sq where coordinate rates
    equal the speeds.
    """
    nu, nq = _port_length(hinge, "u"), _port_length(hinge, "q")
    graph = Graph()
    nodes = _hinge_nodes(graph, hinge)
    inputs = [
        Port("s", (nu,), "", "accelerations of the speeds"),
        Port("motion", (9,), "", "w, wd, and a of the body, own axes"),
        Port("f", (6,), "N, N*m", "carried load at P"),
        Port("J", (nu,), "kg*m2 or kg", "rotor inertia reflected to the speeds"),
        Port("laws", (nu, nu), "", "change of the laws' efforts, a row a direction"),
        Port("along", (nu, nq), "", "change of the coordinates, a row a direction"),
        Port("rate", (1,), "", "change of the speed itself"),
        Port("scale", (1,), "1/s", "and of its acceleration"),
        Port("sq", (1,), "1/s", "inverse time by which coordinates follow speeds"),
    ]
    arguments = nodes | {port.name: element_nodes(graph, port) for port in inputs}
    rows: dict[str, list[Nodes]] = {"B": [], "G": [], "W": []}
    for k in range(nu):
        for name, row in _direction(graph, hinge, arguments, k).items():
            rows[name].append(row)
    outputs = [
        Port("B", (nu, 9), "", "motion along the unknowns, a row a direction"),
        Port("G", (nu, 6), "", "change of the carried load"),
        Port("W", (nu, nu), "", "slopes of the rows by load, rotors and laws"),
        next(port for port in hinge.outputs if port.name == "H"),
    ]
    values: dict[str, object] = {**rows, **_nested_values(outputs[3:], nodes)}
    return graph.kernel(
        "directions", (*hinge.inputs, *inputs), outputs, values,
        purpose="directions of the unknowns of the hinge", sources=_column_kernel(nu).sources,
    )  # fmt: skip


def _direction(
    graph: Graph, hinge: KernelIR, arguments: Mapping[str, Nodes], k: int
) -> dict[str, Nodes]:
    """Rows of B, G and W along unknown k."""
    nu, nq = _port_length(hinge, "u"), _port_length(hinge, "q")
    run, zero = Inliner(graph).run, graph.constant(0)
    rates_are_speeds = nq == nu and all(
        graph.element("u", i).number == rate.number for i, rate in enumerate(arguments["qdot"])
    )
    increments = arguments["along"][nq * k : nq * (k + 1)]
    if rates_are_speeds:
        increments = [1 / arguments["sq"][0] if i == k else zero for i in range(nq)]
    seeds: dict[Node, Node | float] = {graph.element("q", i): d for i, d in enumerate(increments)}
    seeds[graph.element("u", k)] = arguments["rate"][0]
    changes = {
        f"d_{name}": derivatives(arguments[name], seeds) for name in (*_CHANGED_OUTPUTS, "R", "d")
    }
    changes["d_s"] = [arguments["scale"][0] if i == k else zero for i in range(nu)]
    values = {
        **arguments,
        **changes,
        "d_q": increments,
        "laws": arguments["laws"][nu * k : nu * (k + 1)],
    }
    displacement = run(_along_kernel(nu) if rates_are_speeds else _rotation_kernel(), values)
    column = run(
        _column_kernel(nu),
        {**values, **displacement, "Q": run(_carrier_kernel(nu), arguments)["Q"]},
    )
    return {"B": column["B"], "G": column["G"], "W": column["row"]}


def _hinge_nodes(graph: Graph, hinge: KernelIR, guarded: bool = False) -> dict[str, Nodes]:
    """Inputs and outputs of the hinge kernel on a graph; with its guards if `guarded`."""
    inputs = {port.name: element_nodes(graph, port) for port in hinge.inputs}
    messages = {s.code: s.message for s in hinge.statements if isinstance(s, Guard)}

    def guard(condition: Node, code: int) -> None:
        graph.guard(condition, code, messages[code])

    return inputs | Inliner(graph).run(hinge, inputs, guard if guarded else None)


def _port_length(kernel: KernelIR, name: str) -> int:
    return next((int(port.length()) for port in kernel.inputs if port.name == name), 0)


def _nested_values(ports: Sequence[Port], nodes: Mapping[str, Nodes]) -> dict[str, object]:
    """Nodes of ports, nested as their shapes."""

    def nest_port(port: Port) -> object:
        row = nodes[port.name]
        if len(port.shape) == 1:
            return row
        width = int(port.shape[1])
        return [row[width * i : width * (i + 1)] for i in range(int(port.shape[0]))]

    return {port.name: nest_port(port) for port in ports if nodes[port.name]}


@cache
def _forward_kernel(nu: int) -> KernelIR:
    return lower(riccati_sweep.forward_generic(nu), "forward")


@cache
def _carrier_kernel(nu: int) -> KernelIR:
    return lower(hinge_tangent.tangent_carrier(nu), "tangent_carrier")


@cache
def _column_kernel(nu: int) -> KernelIR:
    return lower(hinge_tangent.tangent_column(nu), "tangent_column")


@cache
def _along_kernel(nu: int) -> KernelIR:
    return lower(hinge_tangent.tangent_coordinate_change(nu), "tangent_coordinate_change")


@cache
def _rotation_kernel() -> KernelIR:
    return lower(hinge_tangent.tangent_pose_change(), "tangent_pose_change")
