"""Superposition of small elastic motions of bodies on the rigid motion of a tree.

A small motion displaces the point at r by a + psi x r (inertial axes) and rotates its surroundings
by psi. Hinges transmit it unchanged, because their coordinates are those of the rigid run. A
flexible body adds the small motion of its outboard section and subtracts that of its inboard
section, as far as the hinge there constrains it. A hinge that is part of a closed loop transmits
nothing: it rotates by the rotation of the section, and the section has no other motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import split_reference

from ...packing.rigid_substitution import constrained_rotations
from .response import Response, rigidified_bodies, split_node

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...flexible.modal_parts import ModalPort
    from ..observations import Observations


@dataclass(frozen=True)
class Jet:
    """Vector over time with its first and second rate, (n, 3) each, inertial axes."""

    value: Array
    rate: Array
    second: Array

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, self.rate + other.rate, self.second + other.second)

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.rate, -self.second)

    def cross(self, other: Jet) -> Jet:
        """Cross product self x other."""
        a, b = self, other
        return Jet(
            np.cross(a.value, b.value),
            np.cross(a.rate, b.value) + np.cross(a.value, b.rate),
            np.cross(a.second, b.value)
            + 2 * np.cross(a.rate, b.rate)
            + np.cross(a.value, b.second),
        )


@dataclass(frozen=True)
class SmallMotion:
    """Small motion of a rigid frame: displacement a + psi x r of every point r."""

    origin: Jet
    rotation: Jet

    def __add__(self, other: SmallMotion) -> SmallMotion:
        return SmallMotion(self.origin + other.origin, self.rotation + other.rotation)

    def __neg__(self) -> SmallMotion:
        return SmallMotion(-self.origin, -self.rotation)


class Superposition:
    """Small motions of all nodes of a tree, from the responses of its one-way bodies."""

    def __init__(
        self, model: CompiledScene, rigid: Observations, responses: Mapping[str, Response]
    ) -> None:
        self.model, self.rigid, self.responses = model, rigid, responses
        self.substitution = rigidified_bodies(model)
        packed = rigid.engine.packed
        self.topology, self.hinges = packed.topology, packed.scene.hinges
        self.names, self.order = packed.scene.bodies, packed.topology.order
        self.ends = frozenset(self.substitution.nodes.values())
        self._sections: dict[tuple[str, str], SmallMotion] = {}
        self._constrained_motions: dict[str, SmallMotion] = {}

    def superposed_motion(self, reference: str) -> Array:
        """Motion (n, 24) of "body" or "body.end" including elastic motions inboard of it.

        Columns as in `Observations.points`.
        """
        points = self.rigid.points(reference)
        small = self.small_motion(reference)
        return points if small is None else _add_small_motion(points, small)

    def small_motion(self, reference: str) -> SmallMotion | None:
        """Small motion at a reference; None if no one-way body is inboard of it."""
        body_index = self.rigid.engine.packed.end(reference)[0]
        body, end = split_reference(reference)
        total: SmallMotion | None = None
        exit_end = end if body in self.responses else ""
        is_passed_on = True
        while body_index >= 0:
            name = self.names.name(self.order[body_index])
            if name in self.ends and is_passed_on:
                exit_end = split_node(name)[1]
            if name in self.responses:
                contribution = -self.constrained_motion(name)
                if exit_end:
                    contribution = contribution + self.section(name, exit_end)
                total, exit_end = contribution if total is None else total + contribution, ""
            is_passed_on = (
                self.hinges.name(self.topology.scene_indices(body_index)[1])
                not in self.substitution.loop_hinges
            )
            body_index = self.topology.parents[body_index]
        return total

    def section(self, name: str, end: str) -> SmallMotion:
        """Small motion of a section of a one-way body relative to its rigid position."""
        if (name, end) not in self._sections:
            self._sections[name, end] = self._section(
                name, self.substitution.one_way[name].ports[end]
            )
        return self._sections[name, end]

    def _section(self, name: str, port: ModalPort) -> SmallMotion:
        points, response = self.rigid.points(name), self.responses[name]
        zero = np.zeros((len(points), 3))
        position = _origin_motion(points) + _to_inertial(points, zero + port.position, zero, zero)
        rates = (response.eta, response.etad, response.etadd)
        shift = _to_inertial(points, *(eta @ port.phi.T for eta in rates))
        rotation = _to_inertial(points, *(eta @ port.theta.T for eta in rates))
        return SmallMotion(shift + -rotation.cross(position), rotation)

    def constrained_motion(self, name: str) -> SmallMotion:
        """Part of the inboard section's small motion that the hinge there constrains."""
        if name not in self._constrained_motions:
            self._constrained_motions[name] = self._find_constrained_motion(name)
        return self._constrained_motions[name]

    def _find_constrained_motion(self, name: str) -> SmallMotion:
        end = self.substitution.inboard_ends[name]
        port, hinge = (
            self.substitution.one_way[name].ports[end],
            self.substitution.inboard_hinges.get(name),
        )
        shift = port.phi
        if hinge is None or (hinge.facts is not None and hinge.facts.free_body):
            shift = np.zeros_like(shift)
        zero = np.zeros((3, 3))
        constrained_rotation = (
            zero if hinge is None else constrained_rotations(hinge, port.rotation, unknown=zero)
        )
        return self._section(
            name, replace(port, phi=shift, theta=constrained_rotation @ port.theta)
        )


def _origin_motion(points: Array) -> Jet:
    return Jet(points[:, 0:3], points[:, 3:6], points[:, 6:9])


def _to_inertial(points: Array, value: Array, rate: Array, second: Array) -> Jet:
    """Vector of body components over time, in inertial axes."""
    rotation = points[:, 15:24].reshape(-1, 3, 3)
    spin, spin_rate = points[:, 9:12], points[:, 12:15]
    inertial_value, rate, second = (
        np.einsum("tij,tj->ti", rotation, v) for v in (value, rate, second)
    )
    transport = np.cross(spin, inertial_value)
    return Jet(
        inertial_value,
        transport + rate,
        np.cross(spin_rate, inertial_value)
        + np.cross(spin, transport)
        + 2 * np.cross(spin, rate)
        + second,
    )


def _add_small_motion(points: Array, small: SmallMotion) -> Array:
    """Points (n, 24) with a small motion added: positions to first order, rotations exp(psi~) R."""
    origin = _origin_motion(points)
    origin = origin + small.origin + small.rotation.cross(origin)
    spin, spin_rate, small_rotation = points[:, 9:12], points[:, 12:15], small.rotation
    result = np.array(points)
    result[:, 0:9] = np.concatenate([origin.value, origin.rate, origin.second], axis=1)
    result[:, 9:12] = spin + small_rotation.rate + np.cross(small_rotation.value, spin)
    result[:, 12:15] = (
        spin_rate
        + small_rotation.second
        + np.cross(small_rotation.rate, spin)
        + np.cross(small_rotation.value, spin_rate)
    )
    rotation = points[:, 15:24].reshape(-1, 3, 3)
    result[:, 15:24] = (_exponential(small_rotation.value) @ rotation).reshape(-1, 9)
    return result


def _exponential(vectors: Array) -> Array:
    """Rotations (n, 3, 3) of rotation vectors (n, 3)."""
    angle = np.linalg.norm(vectors, axis=1)
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    tilde = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    first, second = np.sinc(angle / np.pi), np.sinc(angle / (2 * np.pi)) ** 2 / 2
    return np.asarray(np.eye(3) + first[:, None, None] * tilde
                      + second[:, None, None] * (tilde @ tilde))  # fmt: skip
