"""Constraints, speeds and twist rows of every hinge between two bodies in absolute coordinates.

Every hinge is the constraint its name says (coincident points, parallel and perpendicular
vectors); rows and biases come from Taylor arithmetic over a batch of unit twists.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .algebra import attitude, tilde, to_quaternion, triad
from .jets import Array, Jet, apply, atan2, dot, join, stack
from .tree import Hinge, Tree


@dataclass(frozen=True)
class Side:
    """Connection point and hinge frame of one side as jets; omega in inertial axes."""

    point: Jet
    frame: Jet
    omega: Jet


@dataclass(frozen=True)
class Rows:
    """`value`; rate = matrix . (v, omega of parent; of child); its derivative has the bias."""

    value: Array
    matrix: Array
    bias: Array


def _side(r: Array, e: Array, v: Array, w: Array, local: Array, frame: Array) -> Side:
    """Batch of motions of one frame fixed in a body whose mass centre is the point 0."""
    spin, turned = tilde(w), attitude(e)
    turning = Jet(np.broadcast_to(turned, spin.shape), spin @ turned, spin @ spin @ turned)
    point = Jet(r, v, np.zeros_like(v)) + apply(turning, local)
    return Side(point, turning @ frame, Jet(w))


class Absolute:
    """Views on the state vector: 13 numbers per body, then the unwrapped hinge coordinates."""

    def __init__(self, tree: Tree, y: Array) -> None:
        n = len(tree.bodies)
        table = y[: 13 * n].reshape(n, 13)
        ground = np.array([[0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0]], float)
        table = np.vstack([table, ground])
        self.r, self.e, self.v, self.w = np.split(table, [3, 7, 10], axis=1)
        self.q = y[13 * n :]


def sides(tree: Tree, hinge: Hinge, state: Absolute) -> tuple[Side, Side]:
    """Both sides; row 0 of the batch is the actual motion, rows 1 to 12 unit twists."""
    p, c = hinge.parent, hinge.child
    center = tree.bodies[p].center if p >= 0 else np.zeros(3)
    units = np.eye(12)
    v_p = np.vstack([state.v[p], units[:, 0:3]])
    w_p = np.vstack([state.w[p], units[:, 3:6]])
    v_c = np.vstack([state.v[c], units[:, 6:9]])
    w_c = np.vstack([state.w[c], units[:, 9:12]])
    inner = _side(state.r[p], state.e[p], v_p, w_p, hinge.ro - center, hinge.Ro)
    arm = hinge.rp - tree.bodies[c].center
    return inner, _side(state.r[c], state.e[c], v_c, w_c, arm, hinge.Rp)


def constraint(hinge: Hinge, inner: Side, outer: Side) -> Jet | None:
    """Position-level residuals of a hinge over the last axis of the batch."""
    kind = hinge.type
    gap = outer.point - inner.point
    basis = triad(hinge.axis, hinge.axis2 if kind == "planar" else None)
    b, c, a = (apply(inner.frame, basis[:, i]) for i in range(3))
    b_p, c_p, a_p = (apply(outer.frame, basis[:, i]) for i in range(3))
    parallel = [dot(a_p, b), dot(a_p, c)]
    locked = [dot(b_p, c), dot(c_p, a), dot(a_p, b)]
    across = [dot(gap, b), dot(gap, c)]
    point = [gap[..., i] for i in range(3)]
    if kind in ("free", "elastic"):
        return None
    if kind == "screw":
        angle = atan2(dot(b_p, c), dot(b_p, b))
        lag = dot(gap, a) - hinge.pitch * angle
        turns = np.round(lag.x / (2 * np.pi * hinge.pitch))
        return stack([*parallel, *across, lag - 2 * np.pi * hinge.pitch * turns])
    if kind == "universal":
        across_axes = dot(apply(outer.frame, hinge.axis2), a) - float(hinge.axis @ hinge.axis2)
        return stack([*point, across_axes])
    rows = {
        "fixed": [*point, *locked],
        "pin": [*point, *parallel],
        "prismatic": [*across, *locked],
        "cylindrical": [*across, *parallel],
        "planar": [dot(gap, a), *parallel],
        "ball": point,
        "gimbal": point,
    }
    return stack(rows[kind])


def speeds_of(hinge: Hinge, inner: Side, outer: Side) -> Jet | None:
    """Speeds (value) and their rates (first derivative) at zero accelerations."""
    kind = hinge.type
    if kind == "fixed":
        return None
    spin = outer.omega - inner.omega
    gap = apply(inner.frame.transpose, outer.point - inner.point)
    slide = Jet(gap.dx, gap.ddx)
    a = apply(inner.frame, hinge.axis)
    about = dot(spin, a)[..., None]
    along = dot(slide, hinge.axis)[..., None]
    if kind in ("pin", "screw"):
        return about
    if kind == "prismatic":
        return along
    if kind == "cylindrical":
        return join([along, about])
    if kind == "planar":
        e1, e2, _ = triad(hinge.axis, hinge.axis2).T
        return stack([dot(slide, e1), dot(slide, e2), about[..., 0]])
    if kind in ("ball", "free", "elastic"):
        turn = apply(outer.frame.transpose, spin)
        moving = apply(outer.frame.transpose, apply(inner.frame, slide))
        return turn if kind == "ball" else join([moving, turn])
    if kind == "universal":
        return _axis_components([a, apply(outer.frame, hinge.axis2)], spin)
    return _axis_components(_gimbal_axes(inner, outer), spin)


def _gimbal_axes(inner: Side, outer: Side) -> list[Jet]:
    """Axes of Rz Ry Rx: x of the outer side, z of the inner side, y normal to both."""
    x, z = apply(outer.frame, np.eye(3)[0]), apply(inner.frame, np.eye(3)[2])
    k = stack([z[..., 1] * x[..., 2] - z[..., 2] * x[..., 1],
               z[..., 2] * x[..., 0] - z[..., 0] * x[..., 2],
               z[..., 0] * x[..., 1] - z[..., 1] * x[..., 0]])  # fmt: skip
    length = dot(k, k)
    root = Jet(np.sqrt(length.x), length.dx / (2 * np.sqrt(length.x)))
    return [x, k / root[..., None], z]


def _axis_components(axes: list[Jet], spin: Jet) -> Jet:
    """Least-squares components of `spin` along the axes, with the first derivative."""
    basis = np.stack([a.x for a in axes], -1)
    rate = np.stack([a.dx for a in axes], -1)
    inverse = np.linalg.pinv(basis)
    value = inverse @ spin.x[..., None]
    second = inverse @ (spin.dx[..., None] - rate @ value)
    return Jet(value[..., 0], second[..., 0])


def rows_of(jet: Jet, bias: Array, parent: int) -> Rows:
    """Rows over the twelve twist components; `jet` is the rate over the batch."""
    matrix = jet.x[1:].T.copy()
    if parent < 0:
        matrix[:, :6] = 0.0
    return Rows(jet.x[0], matrix, bias)


def refresh(hinge: Hinge, inner: Side, outer: Side, q: Array) -> None:
    """Quaternion and displacement coordinates from the poses; q so far decides the sign."""
    if hinge.type not in ("ball", "free", "elastic"):
        return
    back = inner.frame.x[0].T
    relative = to_quaternion(back @ outer.frame.x[0])
    last = slice(hinge.q.stop - 4, hinge.q.stop)
    q[last] = relative if relative @ q[last] >= 0 else -relative
    if hinge.type != "ball":
        q[hinge.q.start : hinge.q.start + 3] = back @ (outer.point.x[0] - inner.point.x[0])
