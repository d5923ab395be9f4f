"""The sweep in a plane: kernels of pins about parallel axes with what is across the plane left out.

Where every hinge turns about z, motions lie in a plane, and the loads across it move nothing.  Of
rotations two numbers are left, of motions and loads three, of S six.  Each kernel is that of any
motion, replayed where these are all that there is; arrays are laid out as there, and what nothing
in a plane reads is not written.
"""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import replace

from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Nodes, elements, instance
from mstmm.ir.spec import ElementSpec

#: Entries that are left of a load, of S, of a direction in every row of W.
_LOAD, _MASS = (0, 1, 5), (0, 1, 5, 6, 10, 20)
_DIRECTIONS = tuple(6 * row + entry for row in range(6) for entry in _LOAD)
#: (ports, their length) -> entries that are left; other ports have no axes.
_LEFT: dict[tuple[str, int], tuple[int, ...]] = {
    (name, length): left
    for names, length, left in (
        ("motion motion_I motion_C motion_B", 9, (2, 5, 6, 7)),
        ("S S_I", 21, _MASS),
        ("e e_I delta delta_I delta_A delta_B G K K_p J J_A J_B w slip drift relative", 6, _LOAD),
        ("ro r r_e r_A d v v_I v_C v_B", 3, (0, 1)),
        ("w_I w_C w_B", 3, (2,)),
        ("v_rel", 3, ()),
        ("W", 36, _DIRECTIONS),
        ("W", 1, ()),
    )
    for name in names.split()
}  # fmt: skip
_ROTATIONS = ("Rt", "Rc", "R_C", "A", "A_I", "A_C", "A_B")
#: Places across the plane are told, for loads and forces of ends that lie apart.
_READ = {("forward", "ro"): range(3), ("pose", "r"): range(3)}
#: What is written of outputs that others read as well: the kernels of laws, loads and forces.
_WRITTEN = {
    ("forward", "r"): range(3),
    ("forward", "motion"): range(9), ("bias_load", "e"): range(6), ("pose", "A"): range(9),
    ("pose", "x"): range(3), ("velocity", "v"): range(3), ("inertia", "S"): (*_MASS, 11, 15, 18),
}  # fmt: skip
#: Element -> its kernels that have an instance here.
_TAKEN: dict[tuple[str, str], str] = {
    ("hinge", "pin"): "forward",
    ("body", "rigid"): "inertia bias_load",
    ("sweep", "frames"): "pose velocity",
    ("sweep", "generic1"): "factor push push_on_ground answer divide couple answered pull",
    ("sweep", "loops"): "meet slip drift row known told act close shed multiplier_more",
}  # fmt: skip


def planar_spec(specs: Iterable[ElementSpec]) -> ElementSpec:
    """The kernels in a plane, made of those in space."""
    known = {(spec.kind, spec.name): spec for spec in specs}
    kernels = tuple(
        _in_plane(kernel)
        for key, names in _TAKEN.items()
        for kernel in known[key].kernels
        if kernel.name in names.split()
    )
    return ElementSpec("sweep", "planar_pin", "pins in a plane", (), (), (), kernels)


def _in_plane(kernel: KernelIR) -> KernelIR:
    def given(graph: Graph, port: Port) -> Nodes:
        zero, one = graph.constant(0), graph.constant(1)
        if port.name == "H":  # about z
            return [zero] * (port.length() - 1) + [one]
        entries = elements(graph, port)
        if port.name in _ROTATIONS:
            cosine, sine = entries[0], entries[3]
            return [cosine, -sine, zero, sine, cosine, zero, zero, zero, one]
        left = _left(port, _READ.get((kernel.name, port.name)))
        return [entry if k in left else zero for k, entry in enumerate(entries)]

    def kept(port: Port, found: Nodes) -> list[Node | None]:
        left = _left(port, _WRITTEN.get((kernel.name, port.name)))
        return [node if k in left else None for k, node in enumerate(found)]

    made = instance(kernel, given, kept)
    return replace(made, purpose=f"{made.purpose}, in a plane")


def _left(port: Port, more: Iterable[int] | None) -> Container[int]:
    """Entries of an array that are read or written."""
    if more is not None:
        return tuple(more)
    if port.name in _ROTATIONS:
        return (0, 3)
    return _LEFT.get((port.name, port.length()), range(port.length()))
