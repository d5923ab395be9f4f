"""Bodies that a fixed hinge welds: how they lie to each other, and both as one body."""

from __future__ import annotations

from mstmm.numbers.pose import IN_PLACE, ZERO, Pose
from mstmm.numbers.rotations import IDENTITY, Quaternion, Vector, to_quaternion
from mstmm.scene import Body, End, Hinge
from mstmm.scene.robots.masses import joined
from mstmm.scene.robots.robot import Link


def orientation_of(pose: Pose) -> Quaternion | Vector:
    """The axes of a frame as a scene's tables hold them."""
    return ZERO if pose.rotation == IDENTITY else to_quaternion(pose.rotation)


def end_at(pose: Pose) -> End:
    """An end that lies so."""
    return End(position=pose.position, orientation=orientation_of(pose))


def end_of(body: Body, at: str) -> Pose:
    """An end of a body in its axes; "" is its origin."""
    return Pose(body.end_position(at), body.end_rotation(at))


def welded(weld: Hinge, inboard: Body | None, outboard: Body) -> Pose:
    """The outboard body in the axes of the inboard one; None: of the ground."""
    held = Pose(weld.position) if inboard is None else end_of(inboard, weld.inboard_end)
    return held.then(Pose(ZERO, weld.rotation)).then(end_of(outboard, weld.outboard_end).inverse)


def together(whole: Body, part: Body, pose: Pose) -> Body:
    """The first body with the second one's mass and inertia, in the axes of the first; `pose` is
    that of the second in them."""
    mass, center, inertia = joined([(_alone(whole), IN_PLACE), (_alone(part), pose)])
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
