"""Transforms from user frames to internal frames, which are the outboard frames of hinges.

Users give bodies in axes of their choice.  Internally the axes of a body are those of its inboard
hinge: the hinge axis along z, the origin at the end on the hinge.  A hinge axis is then a
coordinate axis, and its elimination yields exact zeros.  Where the hinge moves about or along z
only, the frame is also aligned with the next hinge (`denavit_hartenberg`).
"""

from __future__ import annotations

from dataclasses import dataclass

from mstmm.numerics.rotations import IDENTITY, Matrix, Vector, dot, product, rotate, transpose
from mstmm.scene import Body, Hinge


@dataclass(frozen=True)
class Placement:
    """Internal frame of a body: rotation internal -> user axes, origin in user axes (m).

    It is the outboard frame of the body's hinge, rotated by `turn` about z and shifted by `height`
    (m) along z.
    """

    rotation: Matrix
    origin: Vector
    turn: Matrix = IDENTITY
    height: float = 0.0

    def point(self, position: Vector) -> Vector:
        """Point in the internal frame, m; `position` is in the user frame."""
        a, b = position, self.origin
        return rotate(transpose(self.rotation), (a[0] - b[0], a[1] - b[1], a[2] - b[2]))

    def axes(self, rotation: Matrix) -> Matrix:
        """Rotation matrix in internal axes; `rotation` is in user axes."""
        return product(transpose(self.rotation), rotation)


GROUND = Placement(IDENTITY, (0.0, 0.0, 0.0))


def body_placement(body: Body, end: str, outboard: Matrix) -> Placement:
    """Internal frame of a body whose `end` is on a hinge with outboard axes `outboard`."""
    return Placement(product(body.end_rotation(end), outboard), body.end_position(end))


def connection(
    parent: Placement, parent_body: Body | None, hinge: Hinge, inboard: Matrix, own: Placement
) -> tuple[Matrix, Vector]:
    """Rt (inboard hinge axes -> parent's internal axes) and ro (m) of a hinge.

    The rotation about z and the shift along z of the aligned frame `own` commute with the hinge, so
    they are applied on its inboard side.
    """
    if parent_body is None:
        rotation, position = IDENTITY, hinge.position
    else:
        rotation = parent_body.end_rotation(hinge.inboard_end)
        position = parent_body.end_position(hinge.inboard_end)
    axes = parent.axes(product(product(rotation, hinge.rotation), inboard))
    point = parent.point(position)
    if own.turn == IDENTITY and own.height == 0.0:
        return axes, point
    lift = rotate(axes, (0.0, 0.0, own.height))
    return product(axes, own.turn), (point[0] + lift[0], point[1] + lift[1], point[2] + lift[2])


def rigid_parameters(body: Body, placement: Placement) -> tuple[float, ...]:
    """Numbers of a rigid body in its internal frame: m, m c (3), inertia about the origin (6)."""
    m = body.mass
    c = placement.point(body.center_of_mass)
    j = product(product(transpose(placement.rotation), body.inertia_matrix), placement.rotation)
    square = dot(c, c)
    entries = []
    for a, b in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        steiner = (square if a == b else 0.0) - c[a] * c[b]
        entries.append((j[a][b] + j[b][a]) / 2 + m * steiner)
    return (m, m * c[0], m * c[1], m * c[2], *entries)
