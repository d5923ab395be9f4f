"""Rigid bodies on fixed hinges, merged into their inboard bodies (carriers) in the tree.

The scene keeps them, with their names and ends; in the tree their mass belongs to the carrier, and
their children are its children.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from mstmm.graph.mechanism_graph import GROUND
from mstmm.numerics.rotations import Pose
from mstmm.scene import Body, Scene
from mstmm.scene.checks.topology import BodyRow, Topology

from ..flexible.expansion import ExpandedScene
from ..frame_placement import Placement
from .referenced_parts import referenced_parts
from .simplification import WELDS, Simplification
from .weld_geometry import weld_pose


@dataclass(frozen=True)
class WeldedBodies:
    """Merged bodies, by their numbers in the scene of nodes.

    Attributes:
        carriers: merged body -> its carrier, which is not merged itself.
        poses: merged body -> its pose in the axes of the carrier.
        welds: merged body -> its fixed hinge.
    """

    carriers: Mapping[int, int] = field(default_factory=dict)
    poses: Mapping[int, Pose] = field(default_factory=dict)
    welds: Mapping[int, int] = field(default_factory=dict)

    def pose_in_carrier(self, body: int, whole: Placement) -> Placement:
        """Internal frame `whole` of the carrier in the axes of a merged body."""
        pose = self.poses[body].inverse.compose(Pose(whole.origin, whole.rotation))
        return Placement(pose.rotation, pose.position)

    @cached_property
    def parts(self) -> dict[int, list[int]]:
        """Carrier -> bodies merged into it."""
        parts: dict[int, list[int]] = {}
        for body, carrier in self.carriers.items():
            parts.setdefault(carrier, []).append(body)
        return parts

    def simplifications(self, scene: Scene) -> Iterator[Simplification]:
        """Records of all merged bodies."""
        for body, carrier in self.carriers.items():
            weld, name = scene.hinge[self.welds[body]], scene.body[body].name
            carrier_name = scene.body[carrier].name
            yield Simplification(
                WELDS, (weld.name, name, carrier_name),
                f'body "{name}": merged into "{carrier_name}", as hinge "{weld.name}" between '
                "them is fixed and its load is not used during a run",
            )  # fmt: skip


def find_welded_bodies(expanded: ExpandedScene, tree: Topology) -> WeldedBodies:
    """Find the rigid bodies to be merged: those on a fixed hinge to another rigid body.

    Excluded are hinges that may be released or whose load is used during the run, and sections of
    flexible bodies.  Nothing is merged with one-way coupled bodies, or with closed loops, whose
    assembly depends on the inertia of the bodies at the cut hinges.
    """
    scene, rigidified = expanded.scene, expanded.rigidified
    candidates = [run for run in tree.runs if _is_welded(run, expanded)]
    if not candidates or expanded.cuts or (rigidified is not None and rigidified.one_way):
        return WeldedBodies()
    referenced_hinges = referenced_parts(expanded.user_scene).hinges
    by, poses, welds = dict[int, int](), dict[int, Pose](), dict[int, int]()
    for run in candidates:
        weld, inboard, body = scene.hinge[run.hinge], scene.body[run.on], scene.body[run.body]
        are_rigid = _is_rigid(inboard, expanded) and _is_rigid(body, expanded)
        if weld.name in referenced_hinges or not are_rigid:
            continue
        pose = weld_pose(weld, inboard, body)
        poses[run.body] = poses[run.on].compose(pose) if run.on in poses else pose
        by[run.body], welds[run.body] = by.get(run.on, run.on), run.hinge
    return WeldedBodies(by, poses, welds)


def _is_welded(run: BodyRow, expanded: ExpandedScene) -> bool:
    """Whether a run is a body on a permanent fixed hinge of the user's scene to another body."""
    scene, user_hinges = expanded.scene, len(expanded.user_scene.hinge)
    if run.hinge >= user_hinges or not 0 <= run.on < len(scene.body):
        return False
    hinge = scene.hinge[run.hinge]
    return hinge.is_weld and not hinge.is_released


def _is_rigid(body: Body, expanded: ExpandedScene) -> bool:
    """Whether a body is rigid, and no node of a flexible one."""
    return body.type == "rigid" and not expanded.is_node(body.name)


def contract_tree(tree: Topology, carried: WeldedBodies) -> Topology:
    """Remove merged bodies from the tree; the others keep their order."""
    if not carried.carriers:
        return tree
    places, runs, count = {GROUND: GROUND}, list[BodyRow](), 0
    for run in tree.runs:
        if run.body in carried.carriers:
            places[run.position] = places[run.parent]
            continue
        runs.append(replace(run, position=count, parent=places[run.parent]))
        places |= {run.position + k: count + k for k in range(run.count)}
        count += run.count
    return replace(tree, runs=tuple(runs), carried=carried.carriers)
