"""Users' frames to internal ones: every body is taken into the outboard axes of its hinge.

Users see their own body axes and ends.  Inside, a body's axes are those of its inboard hinge, with
the hinge axis along z and the origin at its input end; a joint axis is then a coordinate axis and
its elimination leaves exact zeros.  Where the hinge moves about and along z alone, the frame is
turned about z and moved along it to suit the next hinge (`alignment`).
"""

from __future__ import annotations

from dataclasses import dataclass

from mstmm.numbers.dual import atan2
from mstmm.numbers.rotations import (
    IDENTITY,
    Matrix,
    Vector,
    apply,
    cross,
    dot,
    norm,
    perpendicular,
    product,
    reject,
    transpose,
)
from mstmm.scene import Body, Hinge

#: Internal hinge kernel of a type where the names differ.
KERNEL_OF = {"elastic": "free"}


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
        return apply(transpose(self.rotation), (a[0] - b[0], a[1] - b[1], a[2] - b[2]))

    def axes(self, rotation: Matrix) -> Matrix:
        """Axes given in user axes -> the same axes in internal axes."""
        return product(transpose(self.rotation), rotation)


GROUND = Placement(IDENTITY, (0.0, 0.0, 0.0))


def _frame(z: Vector, x: Vector) -> Matrix:
    """Rotation with columns x, z x x, z."""
    y = cross(z, x)
    return ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))


def _about(axis: Vector, in_plane: Vector | None) -> Matrix:
    if in_plane is not None:
        return _frame(axis, reject(in_plane, axis))
    return IDENTITY if axis == (0.0, 0.0, 1.0) else _frame(axis, perpendicular(axis))


def alignment(hinge: Hinge) -> tuple[Matrix, Matrix, tuple[float, ...]]:
    """(inboard, outboard) internal hinge axes in the hinge's user axes, and the parameters that
    the built-in kernel takes."""
    axis = hinge.unit_axis
    if hinge.type == "universal":
        second = hinge.unit_axis2
        assert second is not None
        normal = cross(axis, second)
        size = norm(normal)
        x = (normal[0] / size, normal[1] / size, normal[2] / size)
        return _frame(axis, x), _frame(second, x), (atan2(size, dot(axis, second)),)
    if hinge.type in ("ball", "free", "elastic", "gimbal", "fixed"):
        return IDENTITY, IDENTITY, ()
    aligned = _about(axis, hinge.unit_axis2 if hinge.type == "planar" else None)
    return aligned, aligned, (hinge.lead,) if hinge.type == "screw" and hinge.lead else ()


def law_axes(hinge: Hinge) -> Matrix:
    """Axes in which a rotation is split: twist about z, the hinge's axis; in its user axes."""
    return _about(hinge.unit_axis, None)


def place(body: Body, end: str, outboard: Matrix) -> Placement:
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
    lift = apply(turned, (0.0, 0.0, own.height))
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
