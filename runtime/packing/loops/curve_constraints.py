"""Constraint of a point to a curve: a massless frame on a hinge that moves along the curve.

The curve parameter s is the coordinate of that hinge; rows hold the other end in the frame across
the curve.  So no search for the nearest point is needed, curves may intersect themselves, and
revolutions around closed curves are counted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.expression.derivatives import motion
from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import differentiate
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph
from mstmm.ir.hinge_properties import HingeProperties, Param
from mstmm.ir.tape import compile_tape
from mstmm.scene import Constraint, Hinge
from mstmm.scene.tables.hinge import Initial

from ...kernels.prebuilt_kernels import Element

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mstmm.ir.scene_structure import Key

_TITLE, _S, _RATE = "motion along a curve", Param("s"), Param("s_rate", "1/s")
_OUTPUTS = (Port("R", (3, 3)), Port("d", (3,)), Port("H", (6,)), Port("v", (3,)), Port("w", (3,)),
            Port("c", (6,)), Port("qdot", (1,)))  # fmt: skip


def curve_hinge(constraint: Constraint, held: Hinge) -> Hinge:
    """Copy of the hinge `held` that moves along the curve of the constraint."""
    name = _type_name(constraint)
    hinge = held.model_copy(update={
        "type": name, "initial": Initial(q=(constraint.start or 0.0,), u=(0.0,))
    })  # fmt: skip
    hinge.__dict__["facts"] = HingeProperties(
        name, _TITLE, (_S,), (_RATE,), (), "own", (),
        name, None, True, False, ("qqq000",), _kernel(constraint),
    )  # fmt: skip
    return hinge


def curve_elements(constraints: Iterable[Constraint]) -> dict[Key, Element]:
    """Elements of the hinges along curves, evaluated by the tape interpreter."""
    curves = [constraint for constraint in constraints if constraint.curve is not None]
    return {("hinge", _type_name(curve)): _element(curve) for curve in curves}


def _element(constraint: Constraint) -> Element:
    kernel, name = _kernel(constraint), _type_name(constraint)
    derivatives = differentiate(kernel, ("q", "u"), None, values=False, guards=False)
    spec = ElementSpec("hinge", name, _TITLE, (_S,), (_RATE,), (), (kernel,))
    return Element(
        "hinge", name, 1, 1, (), {}, {}, None, compile_tape(kernel), compile_tape(derivatives),
        hash=spec.hash(), spec=spec,
    )  # fmt: skip


def _type_name(constraint: Constraint) -> str:
    return f"{constraint.name}/curve"


def _kernel(constraint: Constraint) -> KernelIR:
    """Kernel of a hinge that translates along c(s): d = c, H = c', bias acceleration c'' s'^2."""
    graph = Graph()
    s, rate = graph.element("q", 0), graph.element("u", 0)
    zero, unit = graph.constant(0), graph.constant(1)
    assert constraint.curve is not None
    position, first, second = zip(
        *(motion(entry, s, lambda _: s) for entry in constraint.curve), strict=True
    )
    no_rotation = [zero] * 3
    values: dict[str, object] = {
        "R": [[unit if i == j else zero for j in range(3)] for i in range(3)],
        "d": list(position), "H": [*first, *no_rotation], "v": [rate * x for x in first],
        "w": no_rotation, "c": [*(rate * rate * x for x in second), *no_rotation], "qdot": [rate],
    }  # fmt: skip
    inputs = [Port("p", (0,)), Port("q", (1,)), Port("u", (1,))]
    return graph.kernel("hinge", inputs, _OUTPUTS, values, purpose=_TITLE)
