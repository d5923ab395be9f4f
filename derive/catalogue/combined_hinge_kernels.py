"""Kernels of a hinge that do in one what its own kernel and the steps for any hinge do apart.

They are those kernels replayed on one graph, where zeros and ones of the hinge's motion fold, and
sines are taken once: nothing is derived anew.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache

from mstmm.ir import Guard, KernelIR, Port
from mstmm.ir.differentiation import derivatives
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Inliner, Nodes, element_nodes

from ..equations import riccati_sweep, tangent_hinge_elimination
from ..lower.kernel_lowering import lower

#: What changes along a direction of the steps for any hinge.
_CHANGES = ("H", "v", "w", "c")


def across_kernels(hinge: KernelIR) -> Iterator[KernelIR]:
    """`forward_kept` of a hinge, and its `directions` if it has speeds, by its kernel "hinge"."""
    yield forward_kept(hinge)
    if _length(hinge, "u"):
        yield directions(hinge)


def forward_kept(hinge: KernelIR) -> KernelIR:
    """The motion across a hinge, and of the body behind it (`forward_generic`)."""
    forward = _forward(_length(hinge, "u"))
    graph = Graph()
    found = _run(graph, hinge, guarded=True)
    more = [port for port in forward.inputs if port.name not in found]
    behind = Inliner(graph).run(forward, found | {p.name: element_nodes(graph, p) for p in more})
    outputs = [*hinge.outputs, *forward.outputs]
    return graph.kernel(
        "forward_kept", (*hinge.inputs, *more), outputs, _values(outputs, found | behind),
        purpose="motion across the hinge and of the body behind it", sources=hinge.sources,
    )  # fmt: skip


def directions(hinge: KernelIR) -> KernelIR:
    """B, G, W and H of all unknowns of a hinge that nobody imposes (`tangent_column`).

    Coordinates follow unknown k by row k of `along`, or by 1 / sq where their rates are the speeds.
    """
    nu, nq = _length(hinge, "u"), _length(hinge, "q")
    graph = Graph()
    found = _run(graph, hinge)
    inputs = [
        Port("s", (nu,), "", "accelerations of the speeds"),
        Port("motion", (9,), "", "w, wd, and a of the body, own axes"),
        Port("f", (6,), "N, N*m", "load at P that is carried"),
        Port("J", (nu,), "kg*m2 or kg", "rotor inertia reflected to the speeds"),
        Port("laws", (nu, nu), "", "change of the laws' efforts, a row a direction"),
        Port("along", (nu, nq), "", "change of the coordinates, a row a direction"),
        Port("rate", (1,), "", "change of the speed itself"),
        Port("scale", (1,), "1/s", "and of its acceleration"),
        Port("sq", (1,), "1/s", "inverse time by which coordinates follow speeds"),
    ]
    given = found | {port.name: element_nodes(graph, port) for port in inputs}
    rows: dict[str, list[Nodes]] = {"B": [], "G": [], "W": []}
    for k in range(nu):
        for name, row in _direction(graph, hinge, given, k).items():
            rows[name].append(row)
    outputs = [
        Port("B", (nu, 9), "", "motion along the unknowns, a row a direction"),
        Port("G", (nu, 6), "", "change of the load that is carried"),
        Port("W", (nu, nu), "", "slopes of the rows by load, rotors and laws"),
        next(port for port in hinge.outputs if port.name == "H"),
    ]
    values: dict[str, object] = {**rows, **_values(outputs[3:], found)}
    return graph.kernel(
        "directions", (*hinge.inputs, *inputs), outputs, values,
        purpose="directions of the unknowns of the hinge", sources=_column(nu).sources,
    )  # fmt: skip


def _direction(
    graph: Graph, hinge: KernelIR, given: Mapping[str, Nodes], k: int
) -> dict[str, Nodes]:
    """Rows of B, G and W along unknown k."""
    nu, nq = _length(hinge, "u"), _length(hinge, "q")
    run, zero = Inliner(graph).run, graph.constant(0)
    straight = nq == nu and all(
        graph.element("u", i).number == rate.number for i, rate in enumerate(given["qdot"])
    )
    follows = given["along"][nq * k : nq * (k + 1)]
    if straight:
        follows = [1 / given["sq"][0] if i == k else zero for i in range(nq)]
    seeds: dict[Node, Node | float] = {graph.element("q", i): d for i, d in enumerate(follows)}
    seeds[graph.element("u", k)] = given["rate"][0]
    changes = {f"d_{name}": derivatives(given[name], seeds) for name in (*_CHANGES, "R", "d")}
    changes["d_s"] = [given["scale"][0] if i == k else zero for i in range(nu)]
    known = {**given, **changes, "d_q": follows, "laws": given["laws"][nu * k : nu * (k + 1)]}
    turned = run(_along(nu) if straight else _turned(), known)
    column = run(_column(nu), {**known, **turned, "Q": run(_carrier(nu), given)["Q"]})
    return {"B": column["B"], "G": column["G"], "W": column["row"]}


def _run(graph: Graph, hinge: KernelIR, guarded: bool = False) -> dict[str, Nodes]:
    """The hinge's own inputs and outputs on a graph, with its guards where they are asked."""
    inputs = {port.name: element_nodes(graph, port) for port in hinge.inputs}
    messages = {s.code: s.message for s in hinge.statements if isinstance(s, Guard)}

    def guard(condition: Node, code: int) -> None:
        graph.guard(condition, code, messages[code])

    return inputs | Inliner(graph).run(hinge, inputs, guard if guarded else None)


def _length(kernel: KernelIR, name: str) -> int:
    return next((int(port.length()) for port in kernel.inputs if port.name == name), 0)


def _values(ports: Sequence[Port], nodes: Mapping[str, Nodes]) -> dict[str, object]:
    """Numbers of ports, nested as their shapes are."""

    def nested(port: Port) -> object:
        row = nodes[port.name]
        if len(port.shape) == 1:
            return row
        width = int(port.shape[1])
        return [row[width * i : width * (i + 1)] for i in range(int(port.shape[0]))]

    return {port.name: nested(port) for port in ports if nodes[port.name]}


@cache
def _forward(nu: int) -> KernelIR:
    return lower(riccati_sweep.forward_generic(nu), "forward")


@cache
def _carrier(nu: int) -> KernelIR:
    return lower(tangent_hinge_elimination.tangent_carrier(nu), "tangent_carrier")


@cache
def _column(nu: int) -> KernelIR:
    return lower(tangent_hinge_elimination.tangent_column(nu), "tangent_column")


@cache
def _along(nu: int) -> KernelIR:
    return lower(tangent_hinge_elimination.tangent_along(nu), "tangent_along")


@cache
def _turned() -> KernelIR:
    return lower(tangent_hinge_elimination.tangent_turned(), "tangent_turned")
