"""Rigid bodies on fixed hinges as part of the bodies that hold them.

The scene keeps them, with their names and ends; in the tree their mass is that of the body that
carries them, and what hangs on them hangs on it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from mstmm.graph.mechanism_graph import GROUND
from mstmm.numerics.pose import Pose
from mstmm.scene import Body, Scene
from mstmm.scene.checks.topology import BodyRow, Topology

from ..flexible.expansion import ExpandedScene
from ..frame_placement import Placement
from .referenced_parts import referenced_parts
from .simplification import WELDS, Simplification
from .weld_geometry import weld_pose


@dataclass(frozen=True)
class WeldedBodies:
    """Bodies that others carry, by their numbers in the scene of nodes.

    Attributes:
        by: body -> the body that carries it, which none carries.
        poses: body -> its axes in those of the one that carries it.
        welds: body -> the hinge that welds it.
    """

    by: Mapping[int, int] = field(default_factory=dict)
    poses: Mapping[int, Pose] = field(default_factory=dict)
    welds: Mapping[int, int] = field(default_factory=dict)

    def placed(self, body: int, whole: Placement) -> Placement:
        """The internal frame of the body that carries another one, as that one has it."""
        seen = self.poses[body].inverse.then(Pose(whole.origin, whole.rotation))
        return Placement(seen.rotation, seen.position)

    @cached_property
    def parts(self) -> dict[int, list[int]]:
        """Body -> the bodies that it carries."""
        found: dict[int, list[int]] = {}
        for body, whole in self.by.items():
            found.setdefault(whole, []).append(body)
        return found

    def told(self, scene: Scene) -> Iterator[Simplification]:
        """A record for each."""
        for body, whole in self.by.items():
            weld, part, one = scene.hinge[self.welds[body]], scene.body[body], scene.body[whole]
            yield Simplification(
                WELDS, (weld.name, part.name, one.name),
                f'body "{part.name}" is packed as part of "{one.name}": the fixed hinge '
                f'"{weld.name}" welds them, and nothing asks for its load in a run',
            )  # fmt: skip


def find_welded_bodies(expanded: ExpandedScene, tree: Topology) -> WeldedBodies:
    """Every rigid body that a fixed hinge of the user's welds to another rigid one.

    Not those whose hinge may let go or whose load a run looks at, and sections of flexible bodies;
    nor any where bodies respond elastically behind the run, or where loops are closed, whose start
    is the nearest one by the inertia of the bodies next to what closes.
    """
    scene, rigidified = expanded.scene, expanded.rigidified
    held = [run for run in tree.runs if _welds(run, expanded)]
    if not held or expanded.cuts or (rigidified is not None and rigidified.one_way):
        return WeldedBodies()
    spoken = referenced_parts(expanded.described).hinges
    by, poses, welds = dict[int, int](), dict[int, Pose](), dict[int, int]()
    for run in held:
        weld, inner, body = scene.hinge[run.hinge], scene.body[run.on], scene.body[run.body]
        if weld.name in spoken or not all(_alone(one, expanded) for one in (inner, body)):
            continue
        pose = weld_pose(weld, inner, body)
        poses[run.body] = poses[run.on].then(pose) if run.on in poses else pose
        by[run.body], welds[run.body] = by.get(run.on, run.on), run.hinge
    return WeldedBodies(by, poses, welds)


def _welds(run: BodyRow, expanded: ExpandedScene) -> bool:
    """Whether a run is a body on a fixed hinge of the user's, which holds, to another body."""
    scene, own = expanded.scene, len(expanded.described.hinge)
    if run.hinge >= own or not 0 <= run.on < len(scene.body):
        return False
    hinge = scene.hinge[run.hinge]
    return hinge.is_weld and not hinge.lets_go


def _alone(body: Body, expanded: ExpandedScene) -> bool:
    """Whether it is a rigid body, and nothing but that."""
    return body.type == "rigid" and not expanded.is_node(body.name)


def contract_tree(tree: Topology, carried: WeldedBodies) -> Topology:
    """The tree without the bodies that others carry; the rest keeps its order."""
    if not carried.by:
        return tree
    places, runs, count = {GROUND: GROUND}, list[BodyRow](), 0
    for run in tree.runs:
        if run.body in carried.by:
            places[run.place] = places[run.parent]
            continue
        runs.append(replace(run, place=count, parent=places[run.parent]))
        places |= {run.place + k: count + k for k in range(run.count)}
        count += run.count
    return replace(tree, runs=tuple(runs), carried=carried.by)
