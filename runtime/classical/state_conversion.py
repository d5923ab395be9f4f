"""Conversion between a state q, u and the motions of bodies in absolute coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.looped_engine import LoopedEngine
from ..packing.packed_scene import PackedScene
from .body_parts import Attachment, Part
from .planar_and_spatial import Form, PartMovement

_MOMENT_FIRST = np.array([3, 4, 5, 0, 1, 2])  # force, moment -> moment, force


def start_movements(
    engine: LoopedEngine, parts: Sequence[Part], t: float, q: Array, u: Array
) -> list[PartMovement]:
    """Movement of parts in a state, with accelerations and loads of their hinges.

    Raises NumericalFailure if the state cannot be evaluated.
    """
    memory = engine.start_memory()
    observation = engine.observe(
        np.array([t]), q[None], u[None], memory[None], [part.frame for part in parts],
        ("points", "loads", "udot"),
    )  # fmt: skip
    if observation.failures:
        raise NumericalFailure(observation.failures[0])
    movements = []
    for part, point in zip(parts, observation.points[0], strict=True):
        axes, modes = point[15:24].reshape(3, 3), np.zeros((3, 0))
        if part.bending is not None:
            first, n = part.bending.u, part.bending.n
            coordinates = q[part.bending.q : part.bending.q + n]
            modes = np.array(
                [coordinates, u[first : first + n], observation.udot[0, first : first + n]]
            )
        movements.append(
            PartMovement(
                point[:3], point[3:6], axes.T @ point[9:12], axes, modes[0], modes[1], point[6:9],
                axes.T @ point[12:15], modes[2], observation.loads[0, part.hinge][_MOMENT_FIRST],
            )
        )  # fmt: skip
    return movements


@dataclass(frozen=True)
class _Section:
    """Section of a part: positions, velocities, spins (n, 3) in inertial axes, axes (n, 3, 3)."""

    position: Array
    velocity: Array
    spin: Array
    axes: Array


class StateConversion:
    """Conversion of successive motions to q, u and memory.

    Angles, quaternions and twists continue from the last ones converted.
    """

    def __init__(self, packed: PackedScene, parts: Sequence[Part], form: Form, q: Array) -> None:
        system = packed.system
        self.parts, self.form, self.first_indices = parts, form, system.first_indices
        self.numbers = [system.body(part.hinge) for part in parts]
        self.nq, self.nu, self.last_q = system.nq, system.nu, q.copy()
        self.memory = np.zeros(max(1, system.n_memory))
        self.memory = self._memory(q[None])[0]

    def convert(self, motions: Array) -> tuple[Array, Array, Array]:
        """Convert motions (n, parts, MOTION) to q (n, nq), u (n, nu) and memory (n, m)."""
        n = len(motions)
        q, u = np.zeros((n, self.nq)), np.zeros((n, self.nu))
        movements = [
            self.form.part_movement(part, k, motions[:, k]) for k, part in enumerate(self.parts)
        ]
        for k, (part, record) in enumerate(zip(self.parts, self.numbers, strict=True)):
            if part.bending is not None:
                modes = slice(part.bending.q, part.bending.q + part.bending.n)
                rates = slice(part.bending.u, part.bending.u + part.bending.n)
                q[:, modes], u[:, rates] = movements[k].eta, movements[k].etad
            if record.nu:
                first_q = int(self.first_indices["q"][part.hinge])
                first_u = int(self.first_indices["u"][part.hinge])
                self._hinge(
                    k, movements, q[:, first_q : first_q + record.nq],
                    u[:, first_u : first_u + record.nu], self.last_q[first_q:],
                )  # fmt: skip
        memory = self._memory(q)
        if n:
            self.last_q, self.memory = q[-1].copy(), memory[-1].copy()
        return q, u, memory

    def _memory(self, q: Array) -> Array:
        """Twists of elastic hinges about the axes of their laws, unwrapped."""
        memory = np.repeat(self.memory[None], len(q), axis=0)
        for part, record in zip(self.parts, self.numbers, strict=True):
            if part.springs is not None:
                index, first = part.springs.twist, int(self.first_indices["q"][part.hinge])
                w, *vector = q[:, first + record.nq - 4 : first + record.nq].T
                axial = np.array(part.springs.law.axes).reshape(3, 3)[:, 2] @ np.array(vector)
                angles = np.append(self.memory[index], 2 * np.arctan2(axial, w))
                memory[:, index] = np.unwrap(angles, period=4 * np.pi)[1:]
        return memory

    def _hinge(self, k: int, moving: list[PartMovement], q: Array, u: Array, last: Array) -> None:
        """Write coordinates and speeds of the inboard hinge of a part into `q` and `u`."""
        part = self.parts[k]
        outboard = _section(
            moving[k],
            np.zeros(3),
            part.end,
            np.zeros_like(part.section_rotation),
            part.section_rotation,
        )
        inboard = _inboard_section(part.attachment, moving, len(q))
        rotation = np.einsum("nji,njk->nik", inboard.axes, outboard.axes)
        spin = np.einsum("nji,nj->ni", outboard.axes, outboard.spin - inboard.spin)
        if u.shape[1] == 1:
            q[:], u[:] = _unwrapped_angles(rotation, last[:1]), spin[:, 2:]
            return
        q[:, -4:] = _continuous_quaternions(rotation, last[q.shape[1] - 4 : q.shape[1]])
        u[:, -3:] = spin
        if u.shape[1] == 6:
            offset = outboard.position - inboard.position
            relative_velocity = (
                outboard.velocity - inboard.velocity - np.cross(inboard.spin, offset)
            )
            q[:, :3] = np.einsum("nji,nj->ni", inboard.axes, offset)
            u[:, :3] = np.einsum("nji,nj->ni", outboard.axes, relative_velocity)


def _inboard_section(hung: Attachment, moving: list[PartMovement], n: int) -> _Section:
    if hung.parent < 0:
        zeros = np.zeros((n, 3))
        return _Section(zeros + hung.point, zeros, zeros, np.broadcast_to(hung.rotation, (n, 3, 3)))
    return _section(moving[hung.parent], hung.point, hung.rotation, hung.shapes, hung.slopes)


def _section(at: PartMovement, point: Array, turn: Array, shapes: Array, slopes: Array) -> _Section:
    """Section of a part whose position is `point` and whose rotation is `turn` at rest."""
    lever = np.einsum("nij,nj->ni", at.axes, point + at.eta @ shapes.T)
    bending_rotation, tangent = _rotations_and_tangents(at.eta @ slopes.T)
    spin = np.einsum("nij,nj->ni", at.axes, at.angular_velocity)
    modal_velocity = np.einsum("nij,nj->ni", at.axes, at.etad @ shapes.T)
    modal_spin = np.einsum("nij,njk,nk->ni", at.axes, tangent, at.etad @ slopes.T)
    return _Section(
        at.position + lever,
        at.velocity + np.cross(spin, lever) + modal_velocity,
        spin + modal_spin,
        at.axes @ bending_rotation @ turn,
    )


def _rotations_and_tangents(vectors: Array) -> tuple[Array, Array]:
    """Rotations exp(v~) and tangents T (n, 3, 3); T dv/dt is the spin in the axes before it."""
    cross = np.zeros((len(vectors), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, k, j], cross[:, j, k] = vectors[:, i], -vectors[:, i]
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    sine_ratio, cosine_ratio = np.sinc(angle / np.pi), np.sinc(angle / 2 / np.pi) ** 2 / 2
    is_small = angle < 1e-2
    safe_angle = np.where(is_small, 1.0, angle)
    sine_remainder = np.where(is_small, (1 - angle**2 / 20) / 6, (1 - sine_ratio) / safe_angle**2)
    square = cross @ cross
    return np.eye(3) + sine_ratio * cross + cosine_ratio * square, np.eye(
        3
    ) + cosine_ratio * cross + sine_remainder * square


def _unwrapped_angles(rotation: Array, last: Array) -> Array:
    """Angles (n, 1) about z, unwrapped from the last one."""
    angles = np.arctan2(
        rotation[:, 1, 0] - rotation[:, 0, 1], rotation[:, 0, 0] + rotation[:, 1, 1]
    )
    return np.unwrap(np.append(last, angles))[1:, None]


def _continuous_quaternions(rotation: Array, last: Array) -> Array:
    """Unit quaternions (n, 4), w first, each with the sign nearest to the previous one."""
    r = rotation
    trace = np.trace(r, axis1=1, axis2=2)
    skew = np.stack(
        [r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1
    )
    products = np.empty((len(r), 4, 4))  # products 4 q_i q_j
    products[:, 0, 0] = 1 + trace
    products[:, 0, 1:] = products[:, 1:, 0] = skew
    products[:, 1:, 1:] = r + np.swapaxes(r, 1, 2)
    for i in range(3):
        products[:, i + 1, i + 1] += 1 - trace
    largest_column = np.argmax(np.diagonal(products, axis1=1, axis2=2), axis=1)
    quaternions = products[np.arange(len(r)), largest_column]
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    sequence = np.vstack([last, quaternions])
    signs = np.where(np.sum(sequence[1:] * sequence[:-1], axis=1) < 0, -1.0, 1.0)
    return np.asarray(quaternions * np.cumprod(signs)[:, None])
