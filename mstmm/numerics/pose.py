"""Poses: position and orientation of one frame in another."""

from __future__ import annotations

from typing import NamedTuple

from .rotations import IDENTITY, Matrix, Vector, product, rotate, transpose

ZERO: Vector = (0.0, 0.0, 0.0)


class Pose(NamedTuple):
    """Pose of a frame in another one: origin (m) and rotation matrix."""

    position: Vector = ZERO
    rotation: Matrix = IDENTITY

    def compose(self, inner: Pose) -> Pose:
        """Compose two poses: `inner` is given in this frame; the result in this frame's parent."""
        x, y, z = rotate(self.rotation, inner.position)
        a, b, c = self.position
        return Pose((a + x, b + y, c + z), product(self.rotation, inner.rotation))

    @property
    def inverse(self) -> Pose:
        """Pose of the parent frame in this frame."""
        inverse_rotation = transpose(self.rotation)
        x, y, z = rotate(inverse_rotation, self.position)
        return Pose((-x, -y, -z), inverse_rotation)


#: Identity pose.
IDENTITY_POSE = Pose()
