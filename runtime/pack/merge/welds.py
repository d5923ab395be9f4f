"""Bodies that a fixed hinge welds: how they lie to each other, and both as one body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.arrays import Array
from mstmm.numbers.rotations import IDENTITY, Matrix, Quaternion, rows, to_quaternion
from mstmm.scene import Body, End, Hinge

#: Orientation of axes that are not turned.
_STRAIGHT = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Pose:
    """How axes lie in others: `turned` (3, 3) from these axes into those, `place` (3,) of their
    origin there, m."""

    turned: Array
    place: Array

    def then(self, inner: Pose) -> Pose:
        """The pose in the outer axes of what lies so in these."""
        return Pose(self.turned @ inner.turned, self.place + self.turned @ inner.place)

    @property
    def inverse(self) -> Pose:
        """The outer axes in these."""
        return Pose(self.turned.T, -self.turned.T @ self.place)

    @property
    def orientation(self) -> Quaternion | tuple[float, float, float]:
        """The rotation as a scene's tables hold it."""
        matrix: Matrix = rows(self.turned.tolist())
        return _STRAIGHT if matrix == IDENTITY else to_quaternion(matrix)

    @property
    def position(self) -> tuple[float, float, float]:
        """The place as a scene's tables hold it, m."""
        x, y, z = self.place.tolist()
        return (x, y, z)

    @property
    def end(self) -> End:
        """An end that lies so."""
        return End(position=self.position, orientation=self.orientation)


def end_of(body: Body, at: str) -> Pose:
    """An end of a body in its axes; "" is its origin."""
    return Pose(np.array(body.end_rotation(at)), np.array(body.end_position(at)))


def welded(weld: Hinge, inboard: Body | None, outboard: Body) -> Pose:
    """The outboard body in the axes of the inboard one; None: of the ground."""
    if inboard is None:
        held = Pose(np.eye(3), np.array(weld.position))
    else:
        held = end_of(inboard, weld.inboard_end)
    turned = Pose(np.array(weld.rotation), np.zeros(3))
    return held.then(turned).then(end_of(outboard, weld.outboard_end).inverse)


def together(whole: Body, part: Body, pose: Pose) -> Body:
    """The first body with the second one's mass and inertia, in the axes of the first (Steiner's
    theorem); `pose` is that of the second in them."""
    masses = (whole.mass, part.mass)
    mass = sum(masses)
    centers = [
        np.array(whole.center_of_mass), pose.place + pose.turned @ np.array(part.center_of_mass)
    ]  # fmt: skip
    inertias = [
        np.array(whole.inertia_matrix),
        pose.turned @ np.array(part.inertia_matrix) @ pose.turned.T,
    ]
    middle = centers[0]
    if mass > 0:
        middle = (masses[0] * centers[0] + masses[1] * centers[1]) / mass
    total = np.zeros((3, 3))
    for m, center, inertia in zip(masses, centers, inertias, strict=True):
        away = center - middle
        total += inertia + m * (away @ away * np.eye(3) - np.outer(away, away))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = total.tolist()
    return whole.model_copy(
        update={
            "mass": mass, "center_of_mass": tuple(middle.tolist()),
            "inertia": (xx, yy, zz, xy, xz, yz),
            "allow_unphysical_inertia":
                whole.allow_unphysical_inertia or part.allow_unphysical_inertia,
        }
    )  # fmt: skip
