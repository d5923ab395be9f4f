"""Simplifications: changes of a scene at compilation that do not change its motion.

Orientations near right angles, such as 1.57079632679, become exact: zeros in their rotation
matrices then need no code and no time.  Rigid bodies on fixed hinges are merged into their inboard
bodies (carriers).  The scene keeps them, with their names and ends; in the tree their mass belongs
to the carrier, and their children are its children.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from mstmm.argument_validation import abbreviate, require_texts
from mstmm.array_validation import finite_float
from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, Name
from mstmm.graph.mechanism_graph import GROUND
from mstmm.numerics.rotations import (
    IDENTITY,
    IDENTITY_POSE,
    ZERO,
    Matrix,
    Pose,
    Quaternion,
    Vector,
    from_rpy,
    to_quaternion,
)
from mstmm.scene import Body, End, Hinge, Scene
from mstmm.scene.checks.expression_names import POINT_QUANTITIES
from mstmm.scene.checks.topology import BodyRow, Topology
from mstmm.scene.robots.robot_model import Link, merge_inertia

from .expansion import ExpandedScene
from .internal_frames import Placement

#: Kinds: rigid bodies on fixed hinges are merged; orientations near right angles become exact;
#: bodies on hinges that move about or along one axis, or rotate about a point, are swept as links.
WELDS, TURNS, LINKS = "welds", "turns", "links"

#: Kind -> singular, plural and description, for the kinds that are reported to users.
COUNT_TEXTS = {
    WELDS: ("body", "bodies", "on fixed hinges merged into their inboard body"),
    TURNS: ("orientation", "orientations", "within a tolerance of right angles replaced by these"),
}
#: Kind -> whether it is done, or up to which tolerance.
SimplifyOptions = Mapping[str, bool | float]
#: Default simplifications, and the default of each kind.  The tolerance (rad) admits right angles
#: written as 1.57079632679, which are off by 4.9e-12, and sums of two.  Numbers with fewer digits
#: (1.570796327: 2e-10 off, 1.5708: 4e-6) change results by more than rounding, so that a larger
#: tolerance must be requested.
USUAL: SimplifyOptions = {WELDS: True, TURNS: 1e-11, LINKS: True}
LINKED: SimplifyOptions = {LINKS: True}
NO_SIMPLIFICATION: SimplifyOptions = {}
#: Largest tolerance, rad.
_MAX_TOLERANCE = 0.01


@dataclass(frozen=True)
class Simplification:
    """Simplification of one part of a scene.

    Attributes:
        kind: "welds", "turns" or "links".
        elements: names of the hinges, bodies and ends concerned.
        text: description and reason.
    """

    kind: str
    elements: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        return self.text


def parse_simplify(simplify: bool | Collection[str] | SimplifyOptions) -> SimplifyOptions:
    """Parse the option `simplify`; kinds that a table does not name keep their defaults.

    Raises SceneError for unknown kinds and invalid values.
    """
    if isinstance(simplify, bool):
        return USUAL if simplify else NO_SIMPLIFICATION
    kinds = require_texts("simplify", list(simplify) if isinstance(simplify, Mapping) else simplify,
                     "welds")  # fmt: skip
    for kind in kinds:
        if kind not in USUAL:
            raise SceneError(
                f"simplify: expected True, False, or some of {', '.join(USUAL)}; found {kind!r:.60}"
            )
    if not isinstance(simplify, Mapping):
        return {kind: USUAL[kind] for kind in kinds}
    for kind in (WELDS, LINKS):
        _check_switch(kind, simplify.get(kind, True))
    options = {kind: USUAL[kind] if value is True else value for kind, value in simplify.items()}
    options = {**USUAL, **options}
    turns = finite_float("simplify: turns", options.get(TURNS) or 0.0)
    if not 0 <= turns <= _MAX_TOLERANCE:
        raise SceneError(
            f"simplify: turns = {turns!r}: expected an angle from 0 to {_MAX_TOLERANCE} rad, or "
            f"True for {USUAL[TURNS]:g}"
        )
    return {kind: value for kind, value in options.items() if value}


def _check_switch(kind: str, value: object) -> None:
    """Raise SceneError unless a value is a boolean."""
    if not (isinstance(value, bool | int | np.bool_) and value in (0, 1)):
        raise SceneError(f"simplify: {kind}: expected True or False, found {abbreviate(value)}")


# --- right angles ---------------------------------------------------------------------------------

#: Largest deviation (rad) of an orientation that is exact up to rounding.
_ROUNDING = 1e-15


def with_right_angles(scene: Scene, tolerance: float) -> tuple[Scene, list[Simplification]]:
    """Make orientations near right angles exact, and record each change; chains are kept.

    Concerned are hinges and ends of bodies that deviate by at most `tolerance` (rad).
    """
    changes = list[Simplification]()
    hinges = tuple(_exact_hinge(hinge, tolerance, changes) for hinge in scene.hinge)
    bodies = tuple(_exact_body(body, tolerance, changes) for body in scene.body)
    if not changes:
        return scene, changes
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    return Scene.model_construct(**fields | {"hinge": hinges, "body": bodies}), changes


def _exact_hinge(hinge: Hinge, tolerance: float, changes: list[Simplification]) -> Hinge:
    nearest = nearest_right_angles(hinge.rotation, tolerance)
    if nearest is None:
        return hinge
    orientation, deviation = nearest
    changes.append(_record((hinge.name,), f'hinge "{hinge.name}"', deviation))
    return hinge.model_copy(update={"orientation": orientation})


def _exact_body(body: Body, tolerance: float, changes: list[Simplification]) -> Body:
    ends = dict(body.ends)
    for name, end in body.ends.items():
        nearest = nearest_right_angles(end.rotation, tolerance)
        if nearest is not None:
            orientation, deviation = nearest
            ends[name] = end.model_copy(update={"orientation": orientation})
            changes.append(_record((body.name, name), f'end "{body.name}.{name}"', deviation))
    return body if ends == body.ends else body.model_copy(update={"ends": ends})


def _record(elements: tuple[str, ...], what: str, deviation: float) -> Simplification:
    text = f"{what}: orientation {deviation:.1e} rad from right angles, replaced by these"
    return Simplification(TURNS, elements, text)


def nearest_right_angles(rotation: Matrix, tolerance: float) -> tuple[Vector, float] | None:
    """Roll, pitch and yaw of the nearest right-angle orientation, and the deviation (rad).

    None where the deviation is rounding only or exceeds `tolerance`.
    """
    nearest = tuple(tuple(float(round(x)) for x in row) for row in rotation)
    squares = (
        (x - y) ** 2
        for row, exact in zip(rotation, nearest, strict=True)
        for x, y in zip(row, exact, strict=True)
    )
    deviation = math.sqrt(sum(squares) / 2.0)
    if not _ROUNDING < deviation <= tolerance:
        return None
    return next((rpy, deviation) for rpy, matrix in _right_angles() if matrix == nearest)


def _right_angles() -> Iterator[tuple[Vector, Matrix]]:
    """All combinations of roll, pitch and yaw in right angles, and their rotation matrices."""
    angles = [k * (math.pi / 2) for k in range(4)]
    for roll, pitch, yaw in product(angles, repeat=3):
        yield (roll, pitch, yaw), from_rpy((roll, pitch, yaw))


# --- geometry of welds ----------------------------------------------------------------------------


def to_orientation(pose: Pose) -> Quaternion | Vector:
    """Orientation of a frame as stored in the tables of a scene."""
    return ZERO if pose.rotation == IDENTITY else to_quaternion(pose.rotation)


def to_end(pose: Pose) -> End:
    """End of a body with this pose."""
    return End(position=pose.position, orientation=to_orientation(pose))


def end_pose(body: Body, at: str) -> Pose:
    """Pose of an end in the axes of its body; "" is the origin."""
    return Pose(body.end_position(at), body.end_rotation(at))


def weld_pose(weld: Hinge, inboard: Body | None, outboard: Body) -> Pose:
    """Pose of the outboard body in the axes of the inboard one (None: the ground)."""
    end = Pose(weld.position) if inboard is None else end_pose(inboard, weld.inboard_end)
    return end.compose(Pose(ZERO, weld.rotation)).compose(
        end_pose(outboard, weld.outboard_end).inverse
    )


def merged_body(whole: Body, part: Body, pose: Pose) -> Body:
    """Body `whole` with the mass and inertia of `part`, given its pose in the axes of `whole`."""
    mass, center, inertia = merge_inertia([(_link(whole), IDENTITY_POSE), (_link(part), pose)])
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    return whole.model_copy(
        update={
            "mass": mass, "center_of_mass": center if mass > 0 else whole.center_of_mass,
            "inertia": (xx, yy, zz, xy, xz, yz),
            "allow_unphysical_inertia":
                whole.allow_unphysical_inertia or part.allow_unphysical_inertia,
        }
    )  # fmt: skip


def _link(body: Body) -> Link:
    return Link(body.name, body.mass, body.center_of_mass, body.inertia_matrix)


# --- parts that expressions, outputs and events refer to, which must be kept ----------------------


@dataclass(frozen=True)
class ReferencedParts:
    """Names of bodies and hinges that simplifications must keep.

    Attributes:
        bodies: referenced by more than positions and velocities of their origin and ends.
        frames: referenced in any way.
        hinges: released or referenced.
    """

    bodies: frozenset[str]
    frames: frozenset[str]
    hinges: frozenset[str]


def referenced_parts(scene: Scene, keep: Collection[str] = ()) -> ReferencedParts:
    """Parts that the scene refers to, and those named in `keep`."""
    names = [name for table in scene for name in _names(table) if len(name.parts) > 1]
    ends = {body.name: set(body.ends) for body in scene.skeleton.body}
    owners = {name.owner for name in names if not _is_point(name, ends)} | {*keep}
    released = {event.hinge for event in scene.event if event.hinge is not None}
    return ReferencedParts(
        frozenset(owners),
        frozenset(owners | {name.owner for name in names}),
        frozenset(released | owners | {name.hinge for name in names}),
    )


def _is_point(name: Name, ends: dict[str, set[str]]) -> bool:
    """Whether a name is a position or velocity component of a body's origin or end."""
    return (
        name.quantity in POINT_QUANTITIES
        and name.owner in ends
        and (len(name.parts) == 2 or (len(name.parts) == 3 and name.parts[1] in ends[name.owner]))
    )


def _names(value: Any) -> Iterator[Name]:
    """Names in all expressions of a table or container."""
    if isinstance(value, Expression):
        yield from value.names
    elif isinstance(value, (list, tuple)):
        for entry in value:
            yield from _names(entry)
    elif isinstance(value, dict):
        for entry in value.values():
            yield from _names(entry)
    elif hasattr(type(value), "model_fields"):
        for key in type(value).model_fields:
            yield from _names(getattr(value, key))


# --- merged bodies --------------------------------------------------------------------------------


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
