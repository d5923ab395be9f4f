"""Chains by dense Newton-Euler equations about the mass centres: knows nothing of mstmm.

Unknown are every body's acceleration of the mass centre and angular acceleration, every hinge's
wrench and free accelerations; one linear system for all of them.  Inertial axes throughout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Body:
    """Rigid body: mass centre and output end from the input end, inertia about the mass centre."""

    mass: float
    r_io: Array
    r_ic: Array
    j_c: Array
    omega: Array
    f_c: Array
    m_c: Array

    @property
    def j_i(self) -> Array:
        """Inertia about the input end, by Steiner."""
        r = self.r_ic
        return self.j_c + self.mass * (r @ r * np.eye(3) - np.outer(r, r))


@dataclass(frozen=True)
class Joint:
    """Hinge before a body: motion subspace H (6 x nf, v over w), bias, offset, efforts."""

    subspace: Array
    bias: Array
    offset: Array
    effort: Array


def random_body(rng: np.random.Generator) -> Body:
    """Full inertia about the mass centre, skew ends, every load."""
    points = rng.normal(size=(3, 6)) * rng.uniform(0.1, 0.5)
    weights = rng.uniform(0.05, 0.3, 6)
    points -= (points @ weights)[:, None] / weights.sum()
    j_c = sum(
        w * (p @ p * np.eye(3) - np.outer(p, p)) for w, p in zip(weights, points.T, strict=True)
    )
    return Body(
        mass=float(weights.sum()),
        r_io=rng.normal(size=3),
        r_ic=rng.normal(size=3) * 0.5,
        j_c=np.asarray(j_c),
        omega=rng.normal(size=3),
        f_c=rng.normal(size=3),
        m_c=rng.normal(size=3),
    )


def planar_body(rng: np.random.Generator) -> Body:
    """The same in the plane z = 0."""
    body = random_body(rng)
    flat, upright = np.diag([1.0, 1, 0]), np.diag([0.0, 0, 1])
    j_c = np.diag([body.j_c[0, 0], body.j_c[1, 1], body.j_c[2, 2]])
    return Body(
        body.mass, flat @ body.r_io, flat @ body.r_ic, j_c, upright @ body.omega,
        flat @ body.f_c, upright @ body.m_c,
    )  # fmt: skip


def output_state(body: Body, state: Array) -> Array:
    """z_O from z_I (13 numbers) by Newton's law for C and Euler's law about C."""
    a_i, alpha, m_i, q_i = (state[3 * k : 3 * k + 3] for k in range(4))
    a_c = _point_acceleration(a_i, alpha, body.omega, body.r_ic)
    q_o = q_i + body.f_c - body.mass * a_c
    rate = body.j_c @ alpha + np.cross(body.omega, body.j_c @ body.omega)
    m_o = m_i + body.m_c - rate + np.cross(-body.r_ic, q_i) - np.cross(body.r_io - body.r_ic, q_o)
    a_o = _point_acceleration(a_i, alpha, body.omega, body.r_io)
    return np.concatenate([a_o, alpha, m_o, q_o, [1.0]])


def _point_acceleration(a: Array, alpha: Array, omega: Array, r: Array) -> Array:
    return a + np.cross(alpha, r) + np.cross(omega, np.cross(omega, r))


def accelerations(bodies: list[Body], joints: list[Joint]) -> list[Array]:
    """[acceleration of the input end; angular acceleration] of every body of a chain on ground."""
    system = _System(bodies, joints)
    for k in range(len(bodies)):
        system.balance(k)
        system.constrain(k)
    solution = np.array(np.linalg.solve(system.matrix, system.right), dtype=np.float64)
    result = []
    for k, body in enumerate(bodies):
        a_c, alpha = solution[system.motion(k)][:3], solution[system.motion(k)][3:]
        result.append(
            np.concatenate([_point_acceleration(a_c, alpha, body.omega, -body.r_ic), alpha])
        )
    return result


class _System:
    """Rows and columns of the dense system."""

    def __init__(self, bodies: list[Body], joints: list[Joint]) -> None:
        self.bodies, self.joints = bodies, joints
        freedoms = [joint.subspace.shape[1] for joint in joints]
        self.starts = np.cumsum([0, *(12 + f for f in freedoms)])
        size = int(self.starts[-1])
        self.matrix, self.right = np.zeros((size, size)), np.zeros(size)
        self.row = 0

    def motion(self, k: int) -> slice:
        return slice(int(self.starts[k]), int(self.starts[k]) + 6)

    def wrench(self, k: int) -> slice:
        return slice(int(self.starts[k]) + 6, int(self.starts[k]) + 12)

    def free_slice(self, k: int) -> slice:
        return slice(int(self.starts[k]) + 12, int(self.starts[k + 1]))

    def add(self, blocks: dict[tuple[int, int], Array], right: Array) -> None:
        count = len(right)
        for (start, stop), block in blocks.items():
            self.matrix[self.row : self.row + count, start:stop] += block
        self.right[self.row : self.row + count] = right
        self.row += count

    def balance(self, k: int) -> None:
        """Newton and Euler about the mass centre of body k; wrench [q; m] of hinge k acts at P."""
        body = self.bodies[k]
        inertia = np.zeros((6, 6))
        inertia[:3, :3], inertia[3:, 3:] = body.mass * np.eye(3), body.j_c
        gyro = np.cross(body.omega, body.j_c @ body.omega)
        blocks = {_span(self.motion(k)): inertia, _span(self.wrench(k)): -_wrench_shift(-body.r_ic)}
        if k + 1 < len(self.bodies):
            arm = body.r_io - body.r_ic + self.joints[k + 1].offset
            blocks[_span(self.wrench(k + 1))] = _wrench_shift(arm)
        self.add(blocks, np.concatenate([body.f_c, body.m_c - gyro]))

    def constrain(self, k: int) -> None:
        """Motion across hinge k and the efforts along its free directions."""
        body, joint = self.bodies[k], self.joints[k]
        right = joint.bias.copy()
        blocks = {
            _span(self.motion(k)): _wrench_shift(-body.r_ic).T,
            _span(self.free_slice(k)): -joint.subspace,
        }
        right[:3] -= np.cross(body.omega, np.cross(body.omega, -body.r_ic))
        if k > 0:
            inboard = self.bodies[k - 1]
            arm = inboard.r_io - inboard.r_ic
            blocks[_span(self.motion(k - 1))] = -_wrench_shift(arm + joint.offset).T
            right[:3] += np.cross(inboard.omega, np.cross(inboard.omega, arm))
        self.add(blocks, right)
        self.add({_span(self.wrench(k)): joint.subspace.T}, joint.effort)


def _span(part: slice) -> tuple[int, int]:
    return part.start, part.stop


def _wrench_shift(arm: Array) -> Array:
    """[q; m] acting `arm` away, as force and moment about the mass centre (6 x 6)."""
    shifted = np.eye(6)
    shifted[3:, :3] = np.column_stack([np.cross(arm, e) for e in np.eye(3)])
    return shifted
