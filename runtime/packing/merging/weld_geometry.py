"""Geometry of welds: relative pose of two bodies on a fixed hinge, and their merged body."""

from __future__ import annotations

from mstmm.numerics.rotations import (
    IDENTITY,
    IDENTITY_POSE,
    ZERO,
    Pose,
    Quaternion,
    Vector,
    to_quaternion,
)
from mstmm.scene import Body, End, Hinge
from mstmm.scene.robots.robot_model import Link, merge_inertia


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
