"""Conversion between a state q, u and the motions of bodies in absolute coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..engine.engine import Engine
from ..pack.packed import Packed
from .forms import Form, Moving
from .parts import Hung, Part

_OPPOSITE = np.array([3, 4, 5, 0, 1, 2])  # force, moment -> moment, force


def start_of(engine: Engine, parts: Sequence[Part], t: float, q: Array, u: Array) -> list[Moving]:
    """Movement of parts in a state, with accelerations and loads of their hinges.

    Raises NumericalFailure if the state cannot be evaluated.
    """
    memory = engine.start_memory()
    seen = engine.observe(
        np.array([t]), q[None], u[None], memory[None], [part.frame for part in parts],
        ("points", "loads", "udot"),
    )  # fmt: skip
    if seen.failures:
        raise NumericalFailure(seen.failures[0])
    found = []
    for part, point in zip(parts, seen.points[0], strict=True):
        axes, modes = point[15:24].reshape(3, 3), np.zeros((3, 0))
        if part.bending is not None:
            first, n = part.bending.u, part.bending.n
            coordinates = q[part.bending.q : part.bending.q + n]
            modes = np.array([coordinates, u[first : first + n], seen.udot[0, first : first + n]])
        found.append(
            Moving(
                point[:3], point[3:6], axes.T @ point[9:12], axes, modes[0], modes[1], point[6:9],
                axes.T @ point[12:15], modes[2], seen.loads[0, part.hinge][_OPPOSITE],
            )
        )  # fmt: skip
    return found


@dataclass(frozen=True)
class _Section:
    """Section of a part: positions, velocities, spins (n, 3) in inertial axes, axes (n, 3, 3)."""

    position: Array
    velocity: Array
    spin: Array
    axes: Array


class States:
    """Conversion of successive motions to q, u and memory.

    Angles, quaternions and twists continue from the last ones converted.
    """

    def __init__(self, packed: Packed, parts: Sequence[Part], form: Form, q: Array) -> None:
        system = packed.system
        self.parts, self.form, self.places = parts, form, system.places
        self.numbers = [system.body(part.hinge) for part in parts]
        self.nq, self.nu, self.last = system.nq, system.nu, q.copy()
        self.memory = np.zeros(max(1, system.n_memory))
        self.memory = self._memory(q[None])[0]

    def of(self, motions: Array) -> tuple[Array, Array, Array]:
        """Convert motions (n, parts, MOTION) to q (n, nq), u (n, nu) and memory (n, m)."""
        n = len(motions)
        q, u = np.zeros((n, self.nq)), np.zeros((n, self.nu))
        moving = [self.form.moving(part, k, motions[:, k]) for k, part in enumerate(self.parts)]
        for k, (part, numbers) in enumerate(zip(self.parts, self.numbers, strict=True)):
            if part.bending is not None:
                modes = slice(part.bending.q, part.bending.q + part.bending.n)
                rates = slice(part.bending.u, part.bending.u + part.bending.n)
                q[:, modes], u[:, rates] = moving[k].eta, moving[k].etad
            if numbers.nu:
                first_q = int(self.places["q"][part.hinge])
                first_u = int(self.places["u"][part.hinge])
                self._hinge(
                    k, moving, q[:, first_q : first_q + numbers.nq],
                    u[:, first_u : first_u + numbers.nu], self.last[first_q:],
                )  # fmt: skip
        memory = self._memory(q)
        if n:
            self.last, self.memory = q[-1].copy(), memory[-1].copy()
        return q, u, memory

    def _memory(self, q: Array) -> Array:
        """Twists of elastic hinges about the axes of their laws, unwrapped."""
        found = np.repeat(self.memory[None], len(q), axis=0)
        for part, numbers in zip(self.parts, self.numbers, strict=True):
            if part.springs is not None:
                place, first = part.springs.twist, int(self.places["q"][part.hinge])
                w, *vector = q[:, first + numbers.nq - 4 : first + numbers.nq].T
                axial = np.array(part.springs.law.axes).reshape(3, 3)[:, 2] @ np.array(vector)
                wrapped = np.append(self.memory[place], 2 * np.arctan2(axial, w))
                found[:, place] = np.unwrap(wrapped, period=4 * np.pi)[1:]
        return found

    def _hinge(self, k: int, moving: list[Moving], q: Array, u: Array, last: Array) -> None:
        """Write coordinates and speeds of the inboard hinge of a part into `q` and `u`."""
        part = self.parts[k]
        outboard = _section(moving[k], np.zeros(3), part.end, np.zeros_like(part.held), part.held)
        inboard = _inboard(part.hung, moving, len(q))
        rotation = np.einsum("nji,njk->nik", inboard.axes, outboard.axes)
        spin = np.einsum("nji,nj->ni", outboard.axes, outboard.spin - inboard.spin)
        if u.shape[1] == 1:
            q[:], u[:] = _angle(rotation, last[:1]), spin[:, 2:]
            return
        q[:, -4:] = _quaternion(rotation, last[q.shape[1] - 4 : q.shape[1]])
        u[:, -3:] = spin
        if u.shape[1] == 6:
            gap = outboard.position - inboard.position
            moved = outboard.velocity - inboard.velocity - np.cross(inboard.spin, gap)
            q[:, :3] = np.einsum("nji,nj->ni", inboard.axes, gap)
            u[:, :3] = np.einsum("nji,nj->ni", outboard.axes, moved)


def _inboard(hung: Hung, moving: list[Moving], n: int) -> _Section:
    if hung.parent < 0:
        still = np.zeros((n, 3))
        return _Section(still + hung.point, still, still, np.broadcast_to(hung.turn, (n, 3, 3)))
    return _section(moving[hung.parent], hung.point, hung.turn, hung.shapes, hung.slopes)


def _section(at: Moving, point: Array, turn: Array, shapes: Array, slopes: Array) -> _Section:
    """Section of a part whose position is `point` and whose rotation is `turn` at rest."""
    lever = np.einsum("nij,nj->ni", at.axes, point + at.eta @ shapes.T)
    bent, tangent = _turns(at.eta @ slopes.T)
    spin = np.einsum("nij,nj->ni", at.axes, at.spin)
    moved = np.einsum("nij,nj->ni", at.axes, at.etad @ shapes.T)
    turning = np.einsum("nij,njk,nk->ni", at.axes, tangent, at.etad @ slopes.T)
    return _Section(
        at.position + lever, at.velocity + np.cross(spin, lever) + moved, spin + turning,
        at.axes @ bent @ turn,
    )  # fmt: skip


def _turns(vectors: Array) -> tuple[Array, Array]:
    """Rotations exp(v~) and tangents T (n, 3, 3); T dv/dt is the spin in the axes before it."""
    cross = np.zeros((len(vectors), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, k, j], cross[:, j, k] = vectors[:, i], -vectors[:, i]
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    one, half = np.sinc(angle / np.pi), np.sinc(angle / 2 / np.pi) ** 2 / 2
    small = angle < 1e-2
    safe = np.where(small, 1.0, angle)
    third = np.where(small, (1 - angle**2 / 20) / 6, (1 - one) / safe**2)
    square = cross @ cross
    return np.eye(3) + one * cross + half * square, np.eye(3) + half * cross + third * square


def _angle(rotation: Array, last: Array) -> Array:
    """Angles (n, 1) about z, unwrapped from the last one."""
    wrapped = np.arctan2(
        rotation[:, 1, 0] - rotation[:, 0, 1], rotation[:, 0, 0] + rotation[:, 1, 1]
    )
    return np.unwrap(np.append(last, wrapped))[1:, None]


def _quaternion(rotation: Array, last: Array) -> Array:
    """Unit quaternions (n, 4), w first, each with the sign nearest to the previous one."""
    r = rotation
    trace = np.trace(r, axis1=1, axis2=2)
    skew = np.stack(
        [r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1
    )
    table = np.empty((len(r), 4, 4))  # products 4 q_i q_j
    table[:, 0, 0] = 1 + trace
    table[:, 0, 1:] = table[:, 1:, 0] = skew
    table[:, 1:, 1:] = r + np.swapaxes(r, 1, 2)
    for i in range(3):
        table[:, i + 1, i + 1] += 1 - trace
    best = np.argmax(np.diagonal(table, axis1=1, axis2=2), axis=1)
    found = table[np.arange(len(r)), best]
    found /= np.linalg.norm(found, axis=1)[:, None]
    before = np.vstack([last, found])
    signs = np.where(np.sum(before[1:] * before[:-1], axis=1) < 0, -1.0, 1.0)
    return np.asarray(found * np.cumprod(signs)[:, None])
