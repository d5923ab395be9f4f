"""Kernels of a planar sweep: pins about parallel axes, without out-of-plane components.

Where every hinge turns about z, motions are planar and out-of-plane loads move nothing.  Rotations
keep two numbers, motions and loads three, S six.  Each kernel is the spatial one evaluated with
these components only, and its arrays store no others.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mstmm.ir import KernelIR, Port
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Nodes, element_nodes, specialise

from ..schedule.planar_passes import LOAD, PLANAR_KERNELS

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
