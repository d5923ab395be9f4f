"""Efforts of hinge laws, spring-damper-actuators and external loads, and their potentials."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .algebra import conjugate, pure, quaternion_matrix, quaternion_product
from .expressions import number
from .jets import Array, as_jet
from .tree import Hinge, Tree


def scope(tree: Tree, q: Array, u: Array, t: float, own: Hinge | None = None) -> dict[str, Any]:
    """Names that an expression may use."""
    names: dict[str, Any] = {"t": t}
    for hinge in tree.hinges:
        names[f"{hinge.name}.q"] = q[hinge.q].tolist()
        names[f"{hinge.name}.u"] = u[hinge.u].tolist()
    if own is not None:
        names |= {"q": q[own.q].tolist(), "u": u[own.u].tolist()}
    return names


def per_speed(value: Any, count: int) -> list[Any]:
    """One entry per speed: a list as it is, anything else shared, None as zero."""
    if isinstance(value, (list, tuple)):
        return list(value)
    return [0.0 if value is None else value] * count


def swing_twist(q: Array, axis: Array) -> Array:
    """Swing rotation vector plus twist angle times axis, hinge frame; q over the last axis.

    q = swing o twist, the twist about `axis`; the twist is 2 atan2 and does not jump within a
    turn.  Works on complex arguments (for differentiation by complex step).
    """
    along = q[..., 1:] @ axis
    length = np.sqrt(q[..., 0] ** 2 + along**2)
    twist = np.concatenate([q[..., :1], along[..., None] * axis], -1) / length[..., None]
    swing = quaternion_product(q, conjugate(twist))[..., 1:]
    square = (swing**2).sum(-1)
    size = np.sqrt(np.where(np.abs(square) < 1e-16, 1.0, square))
    factor = np.where(np.abs(square) < 1e-16, 2.0 + square / 3, 2 * _angle(size, length) / size)
    return np.asarray(factor[..., None] * swing + 2 * _angle(along, q[..., 0])[..., None] * axis)


def _angle(y: Any, x: Any) -> Any:
    """atan2 that keeps the imaginary part of a complex step."""
    base = np.arctan2(np.real(y), np.real(x))
    step = (np.real(x) * np.imag(y) - np.real(y) * np.imag(x)) / (np.real(x) ** 2 + np.real(y) ** 2)
    return base + 1j * step if np.iscomplexobj(y) or np.iscomplexobj(x) else base


def rotational_potential(q: Array, hinge: Hinge, k: Array, rest: Array) -> Any:
    """V = 1/2 sum k_i (s_i - rest_i)^2 of swing and twist, q a quaternion of any length."""
    s = swing_twist(q / np.sqrt((q**2).sum(-1, keepdims=True)), hinge.axis)
    return 0.5 * (k * (s - rest) ** 2).sum(-1)


def rotational_effort(q: Array, hinge: Hinge, k: Array, rest: Array) -> Array:
    """-dV/d(rotation) in outboard axes by complex step."""
    step: Any = 1e-40j * np.eye(3)
    moved: Any = q + quaternion_product(np.broadcast_to(q, (3, 4)), pure(step)) / 2
    return np.asarray(-rotational_potential(moved, hinge, k, rest).imag / 1e-40)


def hinge_effort(tree: Tree, hinge: Hinge, q: Array, u: Array, t: float) -> Array:
    """Effort of the law, conjugate to the speeds, without the reflected inertia's share."""
    law, count = hinge.law, hinge.u.stop - hinge.u.start
    names = scope(tree, q, u, t, hinge)
    own_q, own_u = q[hinge.q], u[hinge.u]
    tau = np.array([number(e, names) for e in per_speed(law.get("effort"), count)])
    tau = tau + _friction(law, own_u)
    damping = np.array([number(c, names) for c in per_speed(law.get("damping"), count)])
    k = np.array([number(c, names) for c in per_speed(law.get("stiffness"), count)])
    rest = np.array([number(c, names) for c in per_speed(law.get("rest"), count)])
    if hinge.type == "ball":
        return tau - damping * own_u + rotational_effort(own_q, hinge, k, rest)
    if hinge.type in ("free", "elastic"):
        rotation = quaternion_matrix(as_jet(own_q[3:])).x
        pull = k[:3] * (own_q[:3] - rest[:3]) + damping[:3] * (rotation @ own_u[:3])
        tau[:3] -= rotation.T @ pull
        tau[3:] += rotational_effort(own_q[3:], hinge, k[3:], rest[3:]) - damping[3:] * own_u[3:]
        return tau
    return tau - damping * own_u - k * (own_q - rest) + _stops(law, own_q, own_u)


def _friction(law: Mapping[str, Any], u: Array) -> Array:
    """-(F_c + (F_s - F_c) exp(-(u/v_s)^2)) tanh(u/v_r) of every speed."""
    out = np.zeros(len(u))
    for i, entry in enumerate(_tables(law.get("friction"), len(u))):
        coulomb = float(entry.get("coulomb") or 0.0)
        static = float(entry.get("static") or coulomb)
        decay = np.exp(-((u[i] / float(entry.get("stribeck_velocity") or 0.01)) ** 2))
        smooth = np.tanh(u[i] / float(entry.get("regularisation_velocity") or 0.001))
        out[i] = -(coulomb + (static - coulomb) * decay) * smooth
    return out


def _stops(law: Mapping[str, Any], q: Array, u: Array) -> Array:
    """One-sided spring-dampers that never pull."""
    out = np.zeros(len(u))
    for i, entry in enumerate(_tables(law.get("limits"), len(u))):
        for sign, key in ((1.0, "upper"), (-1.0, "lower")):
            bound = entry.get(key)
            if bound is not None and sign * (q[i] - bound) > 0:
                push = float(entry.get("stiffness") or 0.0) * sign * (q[i] - bound)
                push += float(entry.get("damping") or 0.0) * sign * u[i]
                out[i] -= sign * max(0.0, push)
    return out


def _tables(value: Any, count: int) -> list[Mapping[str, Any]]:
    return [value or {}] * count if not isinstance(value, (list, tuple)) else list(value)


def hinge_potential(hinge: Hinge, q: Array) -> float:
    """Energy stored in the law's springs (numeric stiffness and rest)."""
    count = hinge.u.stop - hinge.u.start
    k, rest = (
        np.array([float(v) for v in per_speed(hinge.law.get(name), count)])
        for name in ("stiffness", "rest")
    )
    own = q[hinge.q]
    if hinge.type == "ball":
        return float(rotational_potential(own, hinge, k, rest))
    if hinge.type in ("free", "elastic"):
        push = 0.5 * float((k[:3] * (own[:3] - rest[:3]) ** 2).sum())
        return push + float(rotational_potential(own[3:], hinge, k[3:], rest[3:]))
    total = 0.5 * float((k * (own - rest) ** 2).sum())
    for i, entry in enumerate(_tables(hinge.law.get("limits"), count)):
        for sign, key in ((1.0, "upper"), (-1.0, "lower")):
            if entry.get(key) is not None:
                depth = max(0.0, sign * (own[i] - entry[key]))
                total += 0.5 * float(entry.get("stiffness") or 0.0) * depth**2
    return total


def reflected_inertia(hinge: Hinge) -> Array:
    """Reflected rotor inertia of each speed."""
    entries = per_speed(hinge.law.get("inertia"), hinge.u.stop - hinge.u.start)
    return np.array([float(v) for v in entries])


class Motion:
    """Pose and velocity of every body, inertial axes: origins r, rotations A, v, omega.

    Row -1 of each array is ground.
    """

    def __init__(self, tree: Tree) -> None:
        count = len(tree.bodies) + 1
        self.r, self.v, self.w = (np.zeros((count, 3)) for _ in range(3))
        self.A = np.tile(np.eye(3), (count, 1, 1))

    def point(self, body: int, local: Any) -> Array:
        """Inertial position of a point given in body axes."""
        return np.asarray(self.r[body] + self.A[body] @ np.asarray(local, float))

    def velocity(self, body: int, local: Any) -> Array:
        """Inertial velocity of a point given in body axes."""
        return np.asarray(self.v[body] + np.cross(self.w[body], self.A[body] @ np.asarray(local)))


def external_wrenches(tree: Tree, motion: Motion, q: Array, u: Array, t: float) -> Array:
    """Force and moment about the mass centre on every body (N, 6): gravity, loads, springs."""
    out = np.zeros((len(tree.bodies) + 1, 6))
    for i, body in enumerate(tree.bodies):
        out[i, :3] = body.mass * tree.gravity
    names = scope(tree, q, u, t)
    for load in tree.loads:
        number_, position, _ = tree.end(load["on"])
        frame = _axes(tree, motion, load.get("axes") or "inertial", number_)
        force, moment = (
            frame @ np.array([number(v, names) for v in load.get(key) or (0, 0, 0)])
            for key in ("force", "moment")
        )
        _push(tree, motion, out, number_, motion.point(number_, position), force, moment)
    for spring in tree.springs:
        _spring(tree, motion, out, spring, names)
    return out[:-1]


def _axes(tree: Tree, motion: Motion, axes: str, own: int) -> Array:
    if axes == "inertial":
        return np.eye(3)
    return motion.A[own if axes == "body" else tree.body_number(axes)]


def _push(
    tree: Tree, motion: Motion, out: Array, body: int, at: Array, force: Array, moment: Array
) -> None:
    if body >= 0:
        arm = at - motion.point(body, tree.bodies[body].center)
        out[body] += np.concatenate([force, moment + np.cross(arm, force)])


def spring_ends(tree: Tree, spring: Mapping[str, Any]) -> list[tuple[int, Array]]:
    """Body number and local position of the two ends of a spring."""
    places = (spring.get("from") or spring["from_"], spring["to"])
    return [tree.end(place, spring.get("position"))[:2] for place in places]


def _spring(
    tree: Tree, motion: Motion, out: Array, spring: Mapping[str, Any], names: dict[str, Any]
) -> None:
    (a, local_a), (b, local_b) = spring_ends(tree, spring)
    here, there = motion.point(a, local_a), motion.point(b, local_b)
    length = float(np.linalg.norm(there - here))
    along = (there - here) / length
    rate = float(along @ (motion.velocity(b, local_b) - motion.velocity(a, local_a)))
    own = names | {"q": [length], "u": [rate]}
    law = {key: number(value, own) for key, value in (spring.get("law") or {}).items() if value}
    push = law.get("effort", 0.0) - law.get("stiffness", 0.0) * (length - law.get("rest", 0.0))
    push -= law.get("damping", 0.0) * rate
    _push(tree, motion, out, b, there, push * along, np.zeros(3))
    _push(tree, motion, out, a, here, -push * along, np.zeros(3))


def spring_potential(tree: Tree, motion: Motion, spring: Mapping[str, Any]) -> float:
    """Energy stored in a spring between two ends."""
    (a, local_a), (b, local_b) = spring_ends(tree, spring)
    length = float(np.linalg.norm(motion.point(b, local_b) - motion.point(a, local_a)))
    law = spring.get("law") or {}
    return 0.5 * float(law.get("stiffness") or 0) * (length - float(law.get("rest") or 0)) ** 2
