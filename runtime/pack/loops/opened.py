"""A scene with closed loops -> the tree in which every cut hinge ends at a frame of its own.

The frame C of a cut hinge is a body without mass with the ends of the body B that it stands for, so
that a hinge keeps its kernels, coordinates, law and drive, cut or not.  That C is where B is are
the rows of the loop.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from mstmm.scene import Body, End, Scene
from mstmm.scene.checks.topology import build

from .unknown import may_close, refuse_unknown


@dataclass(frozen=True, slots=True)
class Cut:
    """A hinge that closes a loop: its frame stands for `body`, or for an end of it where it is
    flexible, and has a name of its own."""

    hinge: str
    frame: str
    body: str


def opened(scene: Scene) -> tuple[Scene, tuple[Cut, ...]]:
    """The tree, and what is cut in the order of the hinges; a tree is its own.

    Raises SceneError for what closes loops but is no hinge.
    """
    if not may_close(scene):
        return scene, ()
    refuse_unknown(scene)
    plan = build(scene.skeleton).plan
    if plan is None or not plan.cut:
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
        frame = Body(name="frame", mass=0.0)
        bodies.append(frame.model_copy(update={"name": cut.frame, "ends": ends}))
        cuts.append(cut)
    fields = {name: getattr(scene, name) for name in type(scene).model_fields}
    fields |= {"body": tuple(bodies), "hinge": tuple(tables)}
    return Scene.model_construct(**fields), tuple(cuts)
