"""Users' frames to internal ones: every body is taken into the outboard axes of its hinge.

Users see their own body axes and ends.  Inside, a body's axes are those of its inboard hinge, with
the hinge axis along z and the origin at its input end; a joint axis is then a coordinate axis and
its elimination leaves exact zeros.  Where the hinge moves about and along z alone, the frame is
turned about z and moved along it to suit the next hinge (`alignment`).
"""

from __future__ import annotations

from dataclasses import dataclass

from mstmm.numerics.rotations import IDENTITY, Matrix, Vector, dot, product, rotate, transpose
from mstmm.scene import Body, Hinge


@dataclass(frozen=True)
class Placement:
    """Internal frame of a body: rotation internal -> user axes, origin in user axes (m).

    It is the outboard frame of the body's hinge turned by `turn` about z and moved by `height` (m)
    along it.
    """

    rotation: Matrix
    origin: Vector
    turn: Matrix = IDENTITY
    height: float = 0.0

    def point(self, position: Vector) -> Vector:
        """A point in user axes from the user's origin -> internal axes from P."""
        a, b = position, self.origin
        return rotate(transpose(self.rotation), (a[0] - b[0], a[1] - b[1], a[2] - b[2]))

    def axes(self, rotation: Matrix) -> Matrix:
        """Axes given in user axes -> the same axes in internal axes."""
        return product(transpose(self.rotation), rotation)


GROUND = Placement(IDENTITY, (0.0, 0.0, 0.0))


def body_placement(body: Body, end: str, outboard: Matrix) -> Placement:
    """Internal frame of a body held at `end` by a hinge with outboard axes `outboard`."""
    return Placement(product(body.end_rotation(end), outboard), body.end_position(end))


def connection(
    parent: Placement, parent_body: Body | None, hinge: Hinge, inboard: Matrix, own: Placement
) -> tuple[Matrix, Vector]:
    """Rt (inboard hinge axes -> parent's internal axes) and ro, as the frame `own` asks for them.

    A turn about z and a shift along it of the outboard frame pass through the hinge.
    """
    if parent_body is None:
        rotation, position = IDENTITY, hinge.position
    else:
        rotation = parent_body.end_rotation(hinge.inboard_end)
        position = parent_body.end_position(hinge.inboard_end)
    turned = parent.axes(product(product(rotation, hinge.rotation), inboard))
    point = parent.point(position)
    if own.turn == IDENTITY and own.height == 0.0:
        return turned, point
    lift = rotate(turned, (0.0, 0.0, own.height))
    return product(turned, own.turn), (point[0] + lift[0], point[1] + lift[1], point[2] + lift[2])


def rigid_parameters(body: Body, placement: Placement) -> tuple[float, ...]:
    """Mass, mass moment and inertia about P in internal axes, as `body rigid` takes them."""
    m = body.mass
    c = placement.point(body.center_of_mass)
    turned = transpose(placement.rotation)
    j = product(product(turned, body.inertia_matrix), placement.rotation)
    square = dot(c, c)
    entries = []
    for a, b in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        steiner = (square if a == b else 0.0) - c[a] * c[b]
        entries.append((j[a][b] + j[b][a]) / 2 + m * steiner)
    return (m, m * c[0], m * c[1], m * c[2], *entries)
