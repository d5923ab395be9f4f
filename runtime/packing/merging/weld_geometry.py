"""Bodies that a fixed hinge welds: how they lie to each other, and both as one body."""

from __future__ import annotations

from mstmm.numerics.pose import IDENTITY_POSE, ZERO, Pose
from mstmm.numerics.rotations import IDENTITY, Quaternion, Vector, to_quaternion
from mstmm.scene import Body, End, Hinge
from mstmm.scene.robots.merged_inertia import merge_inertia
from mstmm.scene.robots.robot_model import Link


def to_orientation(pose: Pose) -> Quaternion | Vector:
    """The axes of a frame as a scene's tables hold them."""
    return ZERO if pose.rotation == IDENTITY else to_quaternion(pose.rotation)


def to_end(pose: Pose) -> End:
    """An end that lies so."""
    return End(position=pose.position, orientation=to_orientation(pose))


def end_pose(body: Body, at: str) -> Pose:
    """An end of a body in its axes; "" is its origin."""
    return Pose(body.end_position(at), body.end_rotation(at))


def weld_pose(weld: Hinge, inboard: Body | None, outboard: Body) -> Pose:
    """The outboard body in the axes of the inboard one; None: of the ground."""
    held = Pose(weld.position) if inboard is None else end_pose(inboard, weld.inboard_end)
    return held.then(Pose(ZERO, weld.rotation)).then(end_pose(outboard, weld.outboard_end).inverse)


def merged_body(whole: Body, part: Body, pose: Pose) -> Body:
    """The first body with the second one's mass and inertia, in the axes of the first; `pose` is
    that of the second in them."""
    mass, center, inertia = merge_inertia([(_alone(whole), IDENTITY_POSE), (_alone(part), pose)])
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    return whole.model_copy(
        update={
            "mass": mass, "center_of_mass": center if mass > 0 else whole.center_of_mass,
            "inertia": (xx, yy, zz, xy, xz, yz),
            "allow_unphysical_inertia":
                whole.allow_unphysical_inertia or part.allow_unphysical_inertia,
        }
    )  # fmt: skip


def _alone(body: Body) -> Link:
    return Link(body.name, body.mass, body.center_of_mass, body.inertia_matrix)
