"""The sweep in a plane: kernels of pins about parallel axes with what is across the plane left out.

Where every hinge turns about z, motions lie in a plane, and the loads across it move nothing.  Of
rotations two numbers are left, of motions and loads three, of S six.  Each kernel is that of any
motion, replayed where these are all that there is, and its arrays hold these alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mstmm.ir import KernelIR, Port
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Nodes, element_nodes, specialise

from ..schedule.planar_passes import LOAD

#: Entries that are left of S, and of a direction in every row of W.
_MASS = (0, 1, 5, 6, 10, 20)
_DIRECTIONS = tuple(6 * row + entry for row in range(6) for entry in LOAD)
#: (ports, their length) -> entries that are left; others have no axes.  Of the places of bodies
#: the one across the plane stays, for forces of ends that lie apart.
_LEFT: dict[tuple[str, int], tuple[int, ...]] = {
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
#: What is zero, by kernel: the way across a pin and what it prescribes, ends that do not deviate.
_ZERO = {
    "forward": "s", "velocity": "v_rel", "point": "delta gravity", "turning": "delta",
    "factor": "W",
}  # fmt: skip
#: What nobody asks for: a pin leaves P where its inboard point is.
_UNASKED = {"forward": "r", "point": "a_K", "turning": "alpha_K"}
#: Element -> its kernels that have an instance here.
_TAKEN: dict[tuple[str, str], str] = {
    ("hinge", "pin"): "forward",
    ("body", "rigid"): "inertia bias_load",
    ("sweep", "frames"): "pose velocity point turning end_frame applied_load",
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
    zeros, unasked = (table.get(kernel.name, "").split() for table in (_ZERO, _UNASKED))

    def laid(port: Port) -> Port:
        left = _left(port)
        return port if left is None else replace(port, shape=(len(left),))

    def given(graph: Graph, port: Port) -> Nodes:
        zero, one = graph.constant(0), graph.constant(1)
        if port.name == "H":  # about z
            return [zero] * (port.length() - 1) + [one]
        if port.name in zeros:
            return [zero] * port.length()
        entries = element_nodes(graph, laid(port))
        if port.name in _ROTATIONS:
            cosine, sine = entries
            return [cosine, -sine, zero, sine, cosine, zero, zero, zero, one]
        left = _left(port)
        if left is None:
            return entries
        found = [zero] * port.length()
        for place, entry in zip(left, entries, strict=True):
            found[place] = entry
        return found

    def kept(port: Port, found: Nodes) -> list[Node] | None:
        left = _left(port)
        if port.name in unasked:
            return None
        return found if left is None else [found[place] for place in left]

    made = specialise(kernel, given, kept, laid=laid)
    return replace(made, purpose=f"{made.purpose}, in a plane")


def _left(port: Port) -> tuple[int, ...] | None:
    """Entries of an array that are left; None for all."""
    return (0, 3) if port.name in _ROTATIONS else _LEFT.get((port.name, port.length()))
