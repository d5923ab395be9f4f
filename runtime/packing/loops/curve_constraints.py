"""A point on a curve: what moves along the curve is a hinge with one speed, made for it.

The parameter s is a coordinate of its own, without mass: the point of the curve is where it says,
and the other end is held across the curve.  So nothing has to search for the nearest point, a way
that crosses itself is followed on, and turns around a closed curve are counted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.expression.drive import motion
from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import differentiate
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph
from mstmm.ir.hinge_properties import HingeProperties
from mstmm.ir.param import Param
from mstmm.ir.tape import compile_tape
from mstmm.scene import Constraint, Hinge
from mstmm.scene.tables.hinge_keys import Initial

from ...kernels.prebuilt_kernels import Element

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mstmm.ir.scene_structure import Key

_TITLE, _S, _RATE = "a way along a curve", Param("s"), Param("s_rate", "1/s")
_OUTPUTS = (Port("R", (3, 3)), Port("d", (3,)), Port("H", (6,)), Port("v", (3,)), Port("w", (3,)),
            Port("c", (6,)), Port("qdot", (1,)))  # fmt: skip


def curve_hinge(constraint: Constraint, held: Hinge) -> Hinge:
    """The hinge `held` with the curve in place of its weld."""
    name = _type(constraint)
    moving = held.model_copy(update={
        "type": name, "initial": Initial(q=(constraint.start or 0.0,), u=(0.0,))
    })  # fmt: skip
    moving.__dict__["facts"] = HingeProperties(
        name, _TITLE, (_S,), (_RATE,), (), "own", (),
        name, None, True, False, ("qqq000",), _kernel(constraint),
    )  # fmt: skip
    return moving


def curve_elements(constraints: Iterable[Constraint]) -> dict[Key, Element]:
    """The hinges along curves, run by the interpreter."""
    curves = [one for one in constraints if one.curve is not None]
    return {("hinge", _type(curve)): _element(curve) for curve in curves}


def _element(constraint: Constraint) -> Element:
    kernel, name = _kernel(constraint), _type(constraint)
    slope = differentiate(kernel, ("q", "u"), None, values=False, guards=False)
    made = ElementSpec("hinge", name, _TITLE, (_S,), (_RATE,), (), (kernel,))
    return Element(
        "hinge", name, 1, 1, (), {}, {}, None, compile_tape(kernel), compile_tape(slope),
        hash=made.hash(), spec=made,
    )  # fmt: skip


def _type(constraint: Constraint) -> str:
    return f"{constraint.name}/curve"


def _kernel(constraint: Constraint) -> KernelIR:
    """Motion of a hinge without rotation along c(s): d = c, H = c', bias c'' s'^2."""
    graph = Graph()
    s, rate = graph.element("q", 0), graph.element("u", 0)
    zero, one = graph.constant(0), graph.constant(1)
    assert constraint.curve is not None
    place, slope, bend = zip(
        *(motion(entry, s, lambda _: s) for entry in constraint.curve), strict=True
    )
    still = [zero] * 3
    values: dict[str, object] = {
        "R": [[one if i == j else zero for j in range(3)] for i in range(3)],
        "d": list(place), "H": [*slope, *still], "v": [rate * x for x in slope], "w": still,
        "c": [*(rate * rate * x for x in bend), *still], "qdot": [rate],
    }  # fmt: skip
    inputs = [Port("p", (0,)), Port("q", (1,)), Port("u", (1,))]
    return graph.kernel("hinge", inputs, _OUTPUTS, values, purpose=_TITLE)
