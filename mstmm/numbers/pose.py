"""Frames in other frames."""

from __future__ import annotations

from typing import NamedTuple

from .rotations import IDENTITY, Matrix, Vector, apply, product, transpose

ZERO: Vector = (0.0, 0.0, 0.0)


class Pose(NamedTuple):
    """A frame in another one: its origin (m) and its axes."""

    position: Vector = ZERO
    rotation: Matrix = IDENTITY

    def then(self, inner: Pose) -> Pose:
        """A frame given in this one, in the one that this one is given in."""
        x, y, z = apply(self.rotation, inner.position)
        a, b, c = self.position
        return Pose((a + x, b + y, c + z), product(self.rotation, inner.rotation))

    @property
    def inverse(self) -> Pose:
        """The other frame in this one."""
        back = transpose(self.rotation)
        x, y, z = apply(back, self.position)
        return Pose((-x, -y, -z), back)


#: The frame itself.
IN_PLACE = Pose()
