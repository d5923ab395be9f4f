"""Internal frames by the common normals of hinge axes (modified Denavit-Hartenberg).

A hinge that rotates about or translates along its axis allows any position of its outboard frame on
that axis and any angle about it.  The frame is chosen for the first child of the body: x along the
common normal of the two axes, origin at the foot of the normal.  The transform to the child is then
a screw about x followed by one about z, whose constant angle and shift add to the child's own:

    link = (cos alpha, sin alpha, a; theta_0, d_0)

Khalil and Kleinfinger, Proc. IEEE Int. Conf. Robotics and Automation (1986) 1174-1179.
"""

from __future__ import annotations

import math

from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.rotations import Matrix, Pose, Vector, dot, from_rpy, norm, product, rotate
from mstmm.scene import Hinge
from mstmm.scene.tables.hinge_frames import hinge_frames

from .frame_placement import Placement

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
