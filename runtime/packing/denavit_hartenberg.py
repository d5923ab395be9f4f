"""Internal frames by the common normals of hinge axes (modified Denavit-Hartenberg).

A hinge that moves about and along its axis does not care where on the axis its outboard frame
sits, nor how that is turned about the axis.  So the frame is chosen for the body's first child:
x along the common normal of the two axes, origin at the normal's foot.  The child is then one screw
about x and its own screw about z away, whose constant angle and shift add to the hinge's own:

    link = (cos alpha, sin alpha, a; theta_0, d_0)

Khalil and Kleinfinger, Proc. IEEE Int. Conf. Robotics and Automation (1986) 1174-1179.
"""

from __future__ import annotations

import math

from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.pose import Pose
from mstmm.numerics.rotations import Matrix, Vector, dot, from_rpy, norm, product, rotate
from mstmm.scene import Hinge
from mstmm.scene.tables.hinge_frames import hinge_frames

from .frame_placement import Placement

#: Entries of rotations, and lengths over the size of the connection, that are rounding (a few
#: units in the last place of a product of three rotations) and stand for 0 or +-1.
ROUNDING = 2e-15

#: Sine between two axes below which their common normal is too uncertain to be used, and how much
#: farther than the next hinge its foot may lie: a long lever would cost digits of the inertia.
LEAST_SINE, FARTHEST = 1e-2, 4.0

Link = tuple[float, float, float, float, float]


def is_axial(hinge: Hinge) -> bool:
    """Whether the hinge leaves its frames free to turn about and move along z, and runs on kernels
    that know it."""
    facts = hinge.facts
    return facts is not None and facts.axial and facts.runs_as in builtin_hinges()


def snap(value: float, size: float = 1.0) -> float:
    """The value, or the 0 or +-size that it differs from by rounding."""
    for exact in (0.0, size, -size):
        if abs(value - exact) <= ROUNDING * size:
            return exact
    return value


def align_frame(own: Placement, hinge: Hinge, child: tuple[Hinge, Pose] | None) -> Placement:
    """The frame `own` of a body behind `hinge`, turned and moved to suit the hinge of its child.

    `child` is the first hinge that hangs on the body and the end it hangs on, in the body's axes.
    """
    if child is None or not is_axial(hinge) or not is_axial(child[0]):
        return own
    inner, _ = hinge_frames(child[0])
    user = product(product(child[1].rotation, child[0].rotation), inner)
    turned, position = own.axes(user), own.point(child[1].position)
    axis = (turned[0][2], turned[1][2], turned[2][2])
    found = _normal(axis, position)
    if found is None:
        return own
    (c, s), height = found
    turn: Matrix = ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))
    lift = rotate(own.rotation, (0.0, 0.0, height))
    x, y, z = (a + b for a, b in zip(own.origin, lift, strict=True))
    return Placement(product(own.rotation, turn), (x, y, z), turn, height)


def _normal(axis: Vector, point: Vector) -> tuple[tuple[float, float], float] | None:
    """(cosine and sine of x about z, foot on z) of the common normal of z and a line."""
    sine, cosine = snap(math.hypot(axis[0], axis[1])), snap(axis[2])
    size = norm(point)
    if sine == 0.0:
        x, y = (snap(v, size) if size else 0.0 for v in point[:2])
        return (_direction(x, y) if x or y else (1.0, 0.0)), point[2]
    if sine < LEAST_SINE:
        return None
    # feet: z height and axis mu with (point + mu axis - height z) at right angles to both
    along = dot(point, axis)
    height = (point[2] - along * cosine) / sine**2
    mu = (point[2] * cosine - along) / sine**2
    if max(abs(height), abs(mu)) > FARTHEST * size:
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
    """Screw about x and constant part of the one about z that make up a connection, if they do."""
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
    x: Matrix = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    whole = product(x, from_rpy((0.0, 0.0, angle)))
    return (*whole[0], *whole[1], *whole[2], a, -s * d, c * d)
