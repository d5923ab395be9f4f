"""A scene with closed loops -> the tree in which what closes them ends at frames of their own.

The frame C of a cut hinge is a body without mass with the ends of the body B that it stands for, so
that a hinge keeps its kernels, coordinates, law and drive, cut or not.  That C is where B is are
the rows of the loop.  A constraint holds a frame of its own where it begins.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from mstmm.scene import Body, Constraint, End, Scene, split_reference
from mstmm.scene.checks.topology import build_topology

from .constraint_frames import frame_hinge
from .loop_detection import may_have_loops


@dataclass(frozen=True, slots=True)
class Cut:
    """What closes a loop: the frame of `hinge` stands for `body`, or for an end of it where it is
    flexible, and has a name of its own.

    The hinge is one of the scene that is cut, or holds the frame of a `constraint`.
    """

    hinge: str
    frame: str
    body: str
    constraint: Constraint | None = None


def cut_loops(scene: Scene) -> tuple[Scene, tuple[Cut, ...]]:
    """The tree, and what closes its loops: cut hinges, then constraints; a tree is its own."""
    if not may_have_loops(scene):
        return scene, ()
    plan = build_topology(scene.skeleton).plan
    if plan is None or not (plan.cut or scene.constraint):
        return scene, ()
    tables, bodies, cuts = list(scene.hinge), list(scene.body), list[Cut]()
    bends = {one.name for one in (*scene.beam, *scene.elastic)}
    for number in plan.cut:
        hinge = tables[number]
        end, name = hinge.outboard_end, f"{hinge.name}/cut"
        cut, ends = Cut(hinge.name, name, hinge.outboard_body), dict[str, End]()
        if cut.body in bends:
            cut, end = replace(cut, body=hinge.outboard), ""
        else:
            ends = scene.bodies.by_name[cut.body].ends
        held = {"outboard": f"{name}.{end}" if end else name, "cut": None}
        tables[number] = hinge.model_copy(update=held)
        bodies.append(_frame(cut.frame, ends))
        cuts.append(cut)
    for constraint in scene.constraint:
        hinge = frame_hinge(constraint)
        tables.append(hinge)
        bodies.append(_frame(hinge.outboard, {}))
        cuts.append(Cut(hinge.name, hinge.outboard, split_reference(constraint.to)[0], constraint))
    fields = {name: getattr(scene, name) for name in type(scene).model_fields}
    fields |= {"body": tuple(bodies), "hinge": tuple(tables), "constraint": ()}
    return Scene.model_construct(**fields), tuple(cuts)


def _frame(name: str, ends: Mapping[str, End]) -> Body:
    return Body(name="frame", mass=0.0).model_copy(update={"name": name, "ends": ends})
