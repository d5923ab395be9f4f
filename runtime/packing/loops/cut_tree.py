"""Spanning tree of a scene: cut hinges and constraints end at massless frames.

The frame C of a cut hinge is a massless body with the ends of the body B that it replaces, so that
the cut hinge keeps its kernels, coordinates, law and drive.  The constraint rows of the loop
require that C coincides with B.  A constraint has a massless frame at its end `from`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from mstmm.numerics.rotations import IDENTITY, to_quaternion
from mstmm.scene import Body, Constraint, End, Hinge, Scene, split_reference
from mstmm.scene.checks.topology import build_topology
from mstmm.scene.tables.closures import CURVE
from mstmm.scene.tables.hinge_frames import axes_about
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ..coordinate_layout import OF_CONSTRAINT
from .curve_constraints import curve_hinge
from .loop_detection import may_have_loops


@dataclass(frozen=True, slots=True)
class Cut:
    """Closure of a loop, by names.

    Attributes:
        hinge: cut hinge, or the hinge that carries the frame of a constraint.
        frame: massless body outboard of the hinge.
        body: body that the frame must coincide with; an end of it if it is flexible.
        constraint: None for a cut hinge.
    """

    hinge: str
    frame: str
    body: str
    constraint: Constraint | None = None


def cut_loops(scene: Scene) -> tuple[Scene, tuple[Cut, ...]]:
    """Scene with a tree topology, and the closures: cut hinges, then constraints."""
    if not may_have_loops(scene):
        return scene, ()
    plan = build_topology(scene.skeleton).plan
    if plan is None or not (plan.cut or scene.constraint):
        return scene, ()
    tables, bodies, cuts = list(scene.hinge), list(scene.body), list[Cut]()
    flexible = {body.name for body in (*scene.beam, *scene.elastic)}
    for number in plan.cut:
        hinge = tables[number]
        end, name = hinge.outboard_end, f"{hinge.name}/cut"
        cut, ends = Cut(hinge.name, name, hinge.outboard_body), dict[str, End]()
        if cut.body in flexible:
            cut, end = replace(cut, body=hinge.outboard), ""
        else:
            ends = scene.bodies.by_name[cut.body].ends
        update = {"outboard": f"{name}.{end}" if end else name, "cut": None}
        tables[number] = hinge.model_copy(update=update)
        bodies.append(_frame(cut.frame, ends))
        cuts.append(cut)
    for constraint in scene.constraint:
        hinge = _frame_hinge(constraint)
        tables.append(hinge)
        bodies.append(_frame(hinge.outboard, {}))
        cuts.append(Cut(hinge.name, hinge.outboard, split_reference(constraint.to)[0], constraint))
    fields = {name: getattr(scene, name) for name in type(scene).model_fields}
    fields |= {"body": tuple(bodies), "hinge": tuple(tables), "constraint": ()}
    return Scene.model_construct(**fields), tuple(cuts)


def _frame_hinge(constraint: Constraint) -> Hinge:
    """Hinge between the end `from` of a constraint and its frame, with a reserved name.

    It is a weld, with z along the normal if there is one; of a point on a curve it moves along it.
    """
    name, normal = f"{constraint.name}{OF_CONSTRAINT}", constraint.unit_normal
    axes = IDENTITY if normal is None else axes_about(normal, None)
    weld = Hinge(name="frame", type="fixed", inboard=GROUND, outboard="frame",
                 orientation=to_quaternion(axes))  # fmt: skip
    on_ground = split_reference(constraint.from_)[0] == GROUND
    weld = weld.model_copy(update={
        "name": name, "inboard": constraint.from_, "outboard": f"{name}/frame",
        "position": constraint.position if on_ground else (0.0, 0.0, 0.0),
    })  # fmt: skip
    return curve_hinge(constraint, weld) if constraint.type == CURVE else weld


def _frame(name: str, ends: Mapping[str, End]) -> Body:
    return Body(name="frame", mass=0.0).model_copy(update={"name": name, "ends": ends})
