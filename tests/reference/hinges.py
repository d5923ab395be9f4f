"""Relative pose of every hinge type as a function of its coordinates, straight from the definition.

With Q the inboard and P the outboard end, at q = 0 the axes of P are those of the hinge frame
(`orientation` in the inboard end's axes), and `axis` is given in them.  R takes axes of P to the
hinge frame, d is P seen from Q in the hinge frame.

| type | R | d |
|---|---|---|
| pin | Rot(a, q0) | 0 |
| prismatic | 1 | a q0 |
| screw | Rot(a, q0) | a q0 lead / 2 pi |
| cylindrical | Rot(a, q1) | a q0 |
| universal | Rot(a, q0) Rot(b, q1) | 0 |
| planar | Rot(n, q2) | e1 q0 + e2 q1 |
| ball | R(quaternion) | 0 |
| free, elastic | R(quaternion) | (q0, q1, q2) |
| gimbal | Rz(q2) Ry(q1) Rx(q0) | 0 |
"""

from __future__ import annotations

import numpy as np

from .algebra import axial, pure, quaternion_matrix, quaternion_product, triad, turn
from .jets import Array, Jet, apply, as_jet, join
from .tree import Hinge


def pose(hinge: Hinge, q: Jet) -> tuple[Jet, Jet]:
    """(R, d) as jets from the coordinates as jets of shape (..., nq)."""
    lead, a = q.x.shape[:-1], hinge.axis
    still, none = as_jet(np.zeros((*lead, 3))), Jet(np.zeros((*lead, 3, 3))) + np.eye(3)
    kind = hinge.type
    if kind == "fixed":
        return none, still
    if kind == "pin":
        return turn(a, q[..., 0]), still
    if kind == "prismatic":
        return none, q[..., 0:1] * a
    if kind == "screw":
        return turn(a, q[..., 0]), q[..., 0:1] * (a * hinge.pitch)
    if kind == "cylindrical":
        return turn(a, q[..., 1]), q[..., 0:1] * a
    if kind == "universal":
        return turn(a, q[..., 0]) @ turn(hinge.axis2, q[..., 1]), still
    if kind == "planar":
        e1, e2, n = triad(a, hinge.axis2).T
        return turn(n, q[..., 2]), q[..., 0:1] * e1 + q[..., 1:2] * e2
    if kind == "ball":
        return quaternion_matrix(q), still
    if kind == "gimbal":
        x, y, z = np.eye(3)
        return turn(z, q[..., 2]) @ turn(y, q[..., 1]) @ turn(x, q[..., 0]), still
    if kind in ("free", "elastic"):
        return quaternion_matrix(q[..., 3:]), q[..., :3]
    raise ValueError(f"hinge type {kind!r}")


def coordinate_jet(hinge: Hinge, q: Array, u: Array, udot: Array) -> Jet:
    """Motion of the coordinates from speeds and their rates; q one state, u and udot (..., nu).

    Speeds are the rates of the coordinates, except of quaternions (angular velocity in outboard
    axes) and of the displacement of free and elastic hinges (velocity in outboard axes).
    """
    q = np.broadcast_to(q, (*u.shape[:-1], len(q)))
    if hinge.type == "ball":
        return _quaternion_jet(q, u, udot)
    if hinge.type in ("free", "elastic"):
        turning = _quaternion_jet(q[..., 3:], u[..., 3:], udot[..., 3:])
        velocity = apply(quaternion_matrix(turning), Jet(u[..., :3], udot[..., :3]))
        return join([Jet(q[..., :3], velocity.x, velocity.dx), turning])
    return Jet(q, u, udot)


def _quaternion_jet(q: Array, omega: Array, alpha: Array) -> Jet:
    rate = quaternion_product(q, pure(omega)) / 2
    second = (quaternion_product(rate, pure(omega)) + quaternion_product(q, pure(alpha))) / 2
    return Jet(q, rate, second)


def angular(rotation: Jet) -> Jet:
    """Angular velocity (value) and acceleration (first derivative) of a rotation, inboard axes."""
    back = np.swapaxes(rotation.x, -1, -2)
    rate = axial(rotation.dx @ back)
    return Jet(rate, axial(rotation.ddx @ back))
