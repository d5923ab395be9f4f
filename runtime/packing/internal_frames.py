"""Transforms from user frames to internal frames, which are the outboard frames of hinges.

Users give bodies in axes of their choice.  Internally the axes of a body are those of its inboard
hinge: the hinge axis along z, the origin at the end on the hinge.  A hinge axis is then a
coordinate axis, and its elimination yields exact zeros.

A hinge that rotates about or translates along its axis allows any position of its outboard frame on
that axis and any angle about it (modified Denavit-Hartenberg).  The frame is chosen for the first
child of the body: x along the common normal of the two axes, origin at the foot of the normal.  The
transform to the child is then a screw about x followed by one about z, whose constant angle and
shift add to the child's own:

    link = (cos alpha, sin alpha, a; theta_0, d_0)

Khalil and Kleinfinger, Proc. IEEE Int. Conf. Robotics and Automation (1986) 1174-1179.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.rotations import (
    IDENTITY,
    Matrix,
    Pose,
    Vector,
    dot,
    from_rpy,
    norm,
    product,
    rotate,
    transpose,
)
from mstmm.scene import Body, Hinge
from mstmm.scene.tables.hinge_frames import hinge_frames


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


# --- common normals of hinge axes -----------------------------------------------------------------

#: Rounding error of rotation entries, and of lengths relative to the connection: a few units in the
#: last place of a product of three rotations.
ROUNDING = 2e-15

#: Sine between two axes below which their common normal is ill-conditioned; largest distance of its
#: foot relative to that of the next hinge, as a long lever loses digits of the inertia.
MIN_SINE, MAX_FOOT_DISTANCE = 1e-2, 4.0

Link = tuple[float, float, float, float, float]


def is_axial(hinge: Hinge) -> bool:
    """Whether a built-in hinge moves about or along z only, so that its frame is free along z."""
    facts = hinge.facts
    return facts is not None and facts.axial and facts.runs_as in builtin_hinges()


def snap(value: float, size: float = 1.0) -> float:
    """Replace a value by 0 or +-size where it differs from it by rounding only."""
    for exact in (0.0, size, -size):
        if abs(value - exact) <= ROUNDING * size:
            return exact
    return value


def align_frame(own: Placement, hinge: Hinge, child: tuple[Hinge, Pose] | None) -> Placement:
    """Align the frame `own` of a body outboard of `hinge` with the first hinge on the body.

    `child` is that hinge and the pose of its inboard end in the body's axes.  The frame stays as it
    is where one of the hinges is not axial or the common normal is ill-conditioned.
    """
    if child is None or not is_axial(hinge) or not is_axial(child[0]):
        return own
    child_hinge, end = child
    inboard, _ = hinge_frames(child_hinge)
    child_axes = own.axes(product(product(end.rotation, child_hinge.rotation), inboard))
    axis = (child_axes[0][2], child_axes[1][2], child_axes[2][2])
    normal = _common_normal(axis, own.point(end.position))
    if normal is None:
        return own
    (c, s), height = normal
    turn: Matrix = ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
    lift = rotate(own.rotation, (0.0, 0.0, height))
    x, y, z = (a + b for a, b in zip(own.origin, lift, strict=True))
    return Placement(product(own.rotation, turn), (x, y, z), turn, height)


def _common_normal(axis: Vector, point: Vector) -> tuple[tuple[float, float], float] | None:
    """Common normal of z and a line: (cosine, sine) of its angle about z, and its foot on z.

    None where it is ill-conditioned or its foot is too far away.
    """
    sine, cosine = snap(math.hypot(axis[0], axis[1])), snap(axis[2])
    size = norm(point)
    if sine == 0.0:
        x, y = (snap(v, size) if size else 0.0 for v in point[:2])
        return (_direction(x, y) if x or y else (1.0, 0.0)), point[2]
    if sine < MIN_SINE:
        return None
    # Feet `height z` and `point + mu axis`: their difference is perpendicular to both lines.
    along = dot(point, axis)
    height = (point[2] - along * cosine) / sine**2
    mu = (point[2] * cosine - along) / sine**2
    if max(abs(height), abs(mu)) > MAX_FOOT_DISTANCE * size:
        return None
    x, y = -axis[1], axis[0]
    c, s = _direction(x, y)
    length = c * point[0] + s * point[1]
    if length < -ROUNDING * size or (abs(length) <= ROUNDING * size and (c < 0 or c == 0 > s)):
        c, s = -c, -s
    return (c, s), height


def _direction(x: float, y: float) -> tuple[float, float]:
    size = math.hypot(x, y)
    return snap(x / size), snap(y / size)


def link_screws(rotation: Matrix, position: Vector) -> Link | None:
    """Decompose a connection into a screw about x and the constant part of one about z.

    Returns (cos alpha, sin alpha, a, theta_0, d_0), or None where there is no such decomposition.
    """
    size = norm(position)
    sine, cosine = snap(-rotation[1][2]), snap(rotation[2][2])
    if snap(rotation[0][2]) != 0.0 or abs(math.hypot(sine, cosine) - 1) > ROUNDING:
        return None
    a, y, z = (snap(v, size) if size else 0.0 for v in position)
    if snap(cosine * y + sine * z, size or 1.0) != 0.0 and size:
        return None
    shift = cosine * z - sine * y
    angle = math.atan2(snap(-rotation[0][1]), snap(rotation[0][0]))
    return cosine, sine, a, angle, snap(shift, size) if size else 0.0


def link_connection(link: Link) -> tuple[float, ...]:
    """Rt (9) and ro (3) of a link at q = 0."""
    c, s, a, angle, d = link
    about_x: Matrix = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    rotation = product(about_x, from_rpy((0.0, 0.0, angle)))
    return (*rotation[0], *rotation[1], *rotation[2], a, -s * d, c * d)
