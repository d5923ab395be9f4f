"""Kernels of a hinge that combine its own kernel with the generic steps of the sweep.

Those kernels are evaluated on one graph, where zeros and ones of the hinge's motion fold and sines
are shared: no new derivation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache

from mstmm.ir import Guard, KernelIR, Port
from mstmm.ir.differentiation import derivatives, differentiate, jacobian
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Inliner, Nodes, element_nodes, specialise

from ..equations import riccati_sweep
from ..equations import tangent_hinge_elimination as hinge_tangent
from ..lower.kernel_lowering import lower
from ..schedule.planar_passes import LOAD, PLANAR_KERNELS

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


# --- planar sweep ---------------------------------------------------------------------------------
# Where every hinge turns about z, motions are planar and out-of-plane loads move nothing.
# Rotations keep two numbers, motions and loads three, S six.  Each kernel is the spatial one
# evaluated with these components only, and its arrays store no others.

#: In-plane entries of S, and of a direction in every row of W.
_MASS = (0, 1, 5, 6, 10, 20)
_DIRECTIONS = tuple(6 * row + entry for row in range(6) for entry in LOAD)
#: (ports, their length) -> in-plane entries; ports not listed have no axes.  Body positions keep
#: the out-of-plane coordinate, for forces whose ends are in different planes.
_IN_PLANE_ENTRIES: dict[tuple[str, int], tuple[int, ...]] = {
    (name, length): left
    for names, length, left in (
        ("motion motion_I motion_C motion_B", 9, (2, 5, 6, 7)),
        ("S S_I", 21, _MASS),
        ("e e_I delta delta_I delta_A delta_B G K K_p J J_A J_B w slip drift relative", 6, LOAD),
        ("ro r_e r_A d v v_I v_C v_B", 3, (0, 1)),
        ("w_I w_C w_B", 3, (2,)),
        ("floor", 2, (1,)),
        ("p", 10, (0, 1, 2, 9)),
        ("W", 36, _DIRECTIONS),
    )
    for name in names.split()
}  # fmt: skip
_ROTATIONS = ("Rt", "Rc", "R_C", "A", "A_I", "A_C", "A_B")
#: Inputs that are zero, by kernel: position across a pin and its prescribed motion, end deviations.
_ZERO = {
    "forward": "s", "velocity": "v_rel", "point": "delta gravity", "angular_motion": "delta",
    "factor": "W",
}  # fmt: skip
#: Outputs that are never used: P of a pin coincides with its inboard point.
_UNUSED_OUTPUTS = {"forward": "r", "point": "a_K", "angular_motion": "alpha_K"}


def planar_spec(specs: Iterable[ElementSpec]) -> ElementSpec:
    """Planar kernels, made from the spatial ones."""
    spec_by_key = {(spec.kind, spec.name): spec for spec in specs}
    kernels = tuple(
        _planar_kernel(kernel)
        for key, names in PLANAR_KERNELS.values()
        for kernel in spec_by_key[key].kernels
        if kernel.name in names.split()
    )
    return ElementSpec("sweep", "planar_pin", "pins in a plane", (), (), (), kernels)


def _planar_kernel(kernel: KernelIR) -> KernelIR:
    zeros, unused = (table.get(kernel.name, "").split() for table in (_ZERO, _UNUSED_OUTPUTS))

    def planar_port(port: Port) -> Port:
        entries_kept = _in_plane_entries(port)
        return port if entries_kept is None else replace(port, shape=(len(entries_kept),))

    def input_nodes(graph: Graph, port: Port) -> Nodes:
        zero, unit = graph.constant(0), graph.constant(1)
        if port.name == "H":  # about z
            return [zero] * (port.length() - 1) + [unit]
        if port.name in zeros:
            return [zero] * port.length()
        entries = element_nodes(graph, planar_port(port))
        if port.name in _ROTATIONS:
            cosine, sine = entries
            return [cosine, -sine, zero, sine, cosine, zero, zero, zero, unit]
        entries_kept = _in_plane_entries(port)
        if entries_kept is None:
            return entries
        nodes = [zero] * port.length()
        for index, entry in zip(entries_kept, entries, strict=True):
            nodes[index] = entry
        return nodes

    def output_nodes(port: Port, nodes: Nodes) -> list[Node] | None:
        entries_kept = _in_plane_entries(port)
        if port.name in unused:
            return None
        return nodes if entries_kept is None else [nodes[index] for index in entries_kept]

    planar = specialise(kernel, input_nodes, output_nodes, laid=planar_port)
    return replace(planar, purpose=f"{planar.purpose}, in a plane")


def _in_plane_entries(port: Port) -> tuple[int, ...] | None:
    """In-plane entries of an array; None if all are kept."""
    return (0, 3) if port.name in _ROTATIONS else _IN_PLANE_ENTRIES.get((port.name, port.length()))


# --- tangents -------------------------------------------------------------------------------------
# For a kernel `name` in the table, `name_slope` gives the derivatives of its outputs along a
# direction; it is the IR of the kernel differentiated operation by operation (one-sided at kinks
# of a law), so the equations of an element are stated once.  It reads the inputs of the kernel and
# `d_PORT` for each port that varies, and gives `d_PORT` for the outputs.

#: Suffix of the name of a differentiated kernel.
SLOPE = "_slope"
#: Kernels of full derivatives of an output by a port, one row per entry of the port: name ->
#: (kernel, port, output), by kind of the element.
_JACOBIANS = {
    "body": {"load_by_motion": ("bias_load", "motion", "e")},
    "hinge": {
        "rates_by_coordinates": ("hinge", "q", "qdot"),
        "rates_by_speeds": ("hinge", "u", "qdot"),
    },
}

#: kernel -> (ports that vary, outputs; "" for all), by kind and name of the element. "generic"
#: means the steps for any hinge; "hinge", "body" and "force" mean every element of that kind.
_DIFFERENTIATED: dict[str, dict[str, tuple[str, str]]] = {
    "hinge": {"hinge": ("q u", "")},
    "body": {"bias_load": ("motion", "")},
    "force": {"wrench": ("t A_F x_F v_F w_F A_T x_T v_T w_T effort", "F M")},
    "laws": {
        "linear": ("q u effort", "tau"),
        "full": ("q u effort", "tau"),
        "rotation": ("q u effort", "tau"),
        "six": ("q u effort", "tau"),
    },
    "generic": {
        "forward": ("R d H v w c s motion_I", ""),
        "effort": ("H f", ""),
        "complement": ("H", ""),
        "add_known_part": ("y z", ""),
        "add_multiplier_effort": ("y x", ""),
    },
    "frames": {
        "pose": ("A_I x_I Rc r", ""),
        "velocity": ("Rc r v_I w_I v_rel", ""),
        "point": ("A x v motion", "x_K v_K"),
        "angular_motion": ("A motion", "w_K"),
        "end_frame": ("A", ""),
        "applied_load": ("A A_F F M", ""),
        "reaction_wrench": ("x_F x_T F M", ""),
        "length": ("x_F x_T v_F v_T", ""),
        "transport": ("Rc r e", ""),
        "driven_effort": ("load udot tau", ""),
    },
    "loops": {
        "relative_pose": ("A_C x_C A_B x_B Rc r", ""),
        "slip": ("R_C d v_C w_C v_B w_B", ""),
        "drift": ("R_C d slip motion_C motion_B", ""),
        "row": ("w R_C Rc r_A", ""),
        "known_parts": ("W relative", ""),
        "apply_effort": ("J tau", ""),
        "apply_multiplier": ("K x", ""),
        "distance": ("d", "W"),
        "distance_drift": ("d slip", ""),
        "plane": ("d", "W"),
        "rolling": ("R_C d", "W"),
        "rolling_drift": ("R_C slip", ""),
    },
    "modal": {
        "residual": ("eta etad motion", "S_rf e e_f"),
        "prescribed_load": ("S_rf s", ""),
        "momentum": ("eta etad v w", "h h_f"),
        "section": ("eta etad", ""),
        "end_motion": ("x Psi xd Psid xdd Psidd", ""),
        "frame_motion": ("x Psi xd Psid xdd Psidd", ""),
        "segment": ("eta etad", ""),
        "segment_motion": ("Om Omd Omdd", ""),
        "subspace": ("H6 Phi", ""),
        "prescribed_bias": ("H s c", ""),
        "modal_effort": ("H e e_f", ""),
    },
}


def with_slopes(group: str, kernels: Iterable[KernelIR]) -> tuple[KernelIR, ...]:
    """Kernels, then derivatives of those in the table, and combined kernels of hinges."""
    kernels = tuple(kernels)
    differentiated = _DIFFERENTIATED.get(group, {})
    slopes = [slope(k, *differentiated[k.name]) for k in kernels if k.name in differentiated]
    by_name = {kernel.name: kernel for kernel in kernels}
    for name, (kernel, port, output) in _JACOBIANS.get(group, {}).items():
        if next(p for p in by_name[kernel].inputs if p.name == port).length():
            slopes.append(replace(jacobian(by_name[kernel], port, output), name=name))
    if group == "hinge":
        slopes += across_kernels(by_name["hinge"])
    return (*kernels, *slopes)


def slope(kernel: KernelIR, ports: str, outputs: str) -> KernelIR:
    """Differentiated kernel; names of ports that it does not have are ignored."""
    input_names = {port.name for port in kernel.inputs}
    varying = [name for name in ports.split() if name in input_names]
    derivative = differentiate(kernel, varying, outputs.split() or None, values=False, guards=False)
    return replace(derivative, name=kernel.name + SLOPE)
