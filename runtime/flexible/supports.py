"""Supports of flexible bodies: motions of their inboard ends, and inertia of attached bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.checks.flexible_bodies import free_axes
from mstmm.scene.checks.topology import inboard_hinges_by_body
from mstmm.scene.tables.beam import ROOT, Beam
from mstmm.scene.tables.hinge_frames import initial_motion_axes
from mstmm.scene.validators.scalars_and_vectors import GROUND

if TYPE_CHECKING:
    from mstmm.scene import Body, Hinge, Scene


@dataclass(frozen=True)
class Support:
    """Possible motions of the inboard end, and the inertia of what moves with it.

    The twist (v, w; end axes) of the end is `motion` (6, m) times m speeds; the inboard bodies
    have the `inertia` (m, m) for these speeds: kg, kg m, kg m^2.
    """

    motion: Array
    inertia: Array

    @property
    def speeds(self) -> int:
        """Number of speeds."""
        return int(self.motion.shape[1])


#: An end with six free motions, and no known inertia inboard.
ANY = Support(np.eye(6), np.zeros((6, 6)))
#: An end whose motion is prescribed.
RESTING = Support(np.zeros((6, 0)), np.zeros((0, 0)))

#: Largest number of inboard rigid bodies included; the next one counts as free to move.
_MAX_BODIES = 6


class Supports:
    """Supports of the flexible bodies of a scene."""

    def __init__(self, scene: Scene) -> None:
        self._inboard_hinges = inboard_hinges_by_body(scene)
        self._bodies = {body.name: body for body in scene.body if body.type == "rigid"}
        self._beams = {beam.name: beam for beam in scene.beam}
        self._outboard_hinges: dict[str, list[Hinge]] = {}
        for hinge in self._inboard_hinges.values():
            self._outboard_hinges.setdefault(hinge.inboard_body, []).append(hinge)
        self._released = {event.hinge for event in scene.event if event.hinge}

    def support_of(self, name: str) -> Support:
        """Support of a flexible body: its inboard hinge and rigid bodies.

        They are followed up to the ground or to another flexible body.
        """
        hinge = self._inboard_hinges.get(name)
        return ANY if hinge is None else self._hinge_support(hinge)

    def inboard_hinge_support(self, name: str) -> Support:
        """Support of a flexible body by its inboard hinge alone, with the inboard side at rest."""
        hinge = self._inboard_hinges.get(name)
        motions = None if hinge is None else self._free_motions(hinge)
        if hinge is None or motions is None:
            return ANY
        return Support(motions, _rotor_inertia(hinge, motions))

    def _hinge_support(self, hinge: Hinge, followed: int = 0) -> Support:
        """Support at the outboard end of a hinge, its axes, `followed` bodies inboard."""
        motions = self._free_motions(hinge)
        if motions is None or followed > _MAX_BODIES:
            return ANY
        inboard = self._body_support(hinge.inboard_body, followed)
        inboard_body = self._bodies.get(hinge.inboard_body)
        pose = _ORIGIN if inboard_body is None else _end_pose(inboard_body, hinge.inboard_end)
        transform = _hinge_transform(*pose, hinge)
        return Support(
            np.concatenate([transform @ inboard.motion, motions], axis=1),
            _block_diagonal(inboard.inertia, _rotor_inertia(hinge, motions)),
        )

    def _body_support(self, name: str, followed: int) -> Support:
        """Support at the origin of a rigid body, its axes, with the inertia of the body."""
        if name == GROUND:
            return RESTING
        body, hinge = self._bodies.get(name), self._inboard_hinges.get(name)
        if body is None:
            return ANY
        support = ANY
        if hinge is not None and not hinge.outboard_end:
            support = self._hinge_support(hinge, followed + 1)
        inertia = support.motion.T @ _own_inertia(body) @ support.motion
        return Support(support.motion, support.inertia + inertia)

    def outboard_inertia(self, name: str, end: str) -> Array:
        """Inertia (6, 6) of the bodies outboard of an end of a beam, axes of the end, at q = 0.

        Beams count as rigid rods.  Hinges transmit no effort along their free motions.
        """
        total = np.zeros((6, 6))
        for hinge in self._outboard_hinges.get(name, ()):
            if (hinge.inboard_end or ROOT) == end:
                total += self._inertia_outboard_of(hinge, _ORIGIN, 0)
        return total

    def _inertia_outboard_of(
        self, hinge: Hinge, inboard_end: tuple[Array, Array], followed: int
    ) -> Array:
        """Inertia (6, 6) outboard of a hinge, about the origin of its inboard body.

        `inboard_end` is the pose of its inboard end in that body.
        """
        name = hinge.outboard_body
        body = self._bodies.get(name) or self._beams.get(name)
        if body is None:
            return np.zeros((6, 6))
        inertia = _own_inertia(body)
        for other in self._outboard_hinges.get(name, ()):
            if followed < _MAX_BODIES:
                pose = _end_pose(body, other.inboard_end)
                inertia += self._inertia_outboard_of(other, pose, followed + 1)
        to_origin = _twist_at_origin(*_end_pose(body, hinge.outboard_end))
        inertia = to_origin.T @ inertia @ to_origin
        free = self._free_motions(hinge)
        if free is not None and free.shape[1]:
            response = np.linalg.pinv(free.T @ inertia @ free, hermitian=True)
            inertia -= inertia @ free @ response @ free.T @ inertia
        transform = _hinge_transform(*inboard_end, hinge)
        return np.asarray(transform.T @ inertia @ transform)

    def _free_motions(self, hinge: Hinge) -> Array | None:
        """Free motions (6, m) of a hinge, outboard axes; None if they are not known."""
        if hinge.is_released or hinge.name in self._released:
            return None
        if _is_prescribed(hinge):
            return np.zeros((6, 0))
        facts, motions = hinge.facts, initial_motion_axes(hinge)
        if facts is None or motions is None or not facts.in_place:
            return None
        if facts.slides and (facts.turns or not facts.constant_subspace):
            return None
        if facts.slides:
            directions = np.array([translation for translation, _ in motions]).T
            return np.concatenate([directions, np.zeros_like(directions)])
        axes = np.array(free_axes(hinge)).reshape(-1, 3).T
        return np.concatenate([np.zeros_like(axes), axes])


def _is_prescribed(hinge: Hinge) -> bool:
    is_driven = hinge.drive is not None and all(entry is not None for entry in hinge.drive)
    return hinge.is_weld or is_driven


def _rotor_inertia(hinge: Hinge, motion: Array) -> Array:
    """Rotor inertia (m, m) of a hinge; zero unless given for each of its free motions."""
    inertia = np.array(hinge.law.inertia, dtype=float)
    return np.diag(inertia if len(inertia) == motion.shape[1] else np.zeros(motion.shape[1]))


def _block_diagonal(first: Array, second: Array) -> Array:
    matrix = np.zeros((len(first) + len(second),) * 2)
    matrix[: len(first), : len(first)], matrix[len(first) :, len(first) :] = first, second
    return matrix


#: Pose of an end that is the origin of its body.
_ORIGIN = np.zeros(3), np.eye(3)


def _end_pose(body: Body | Beam, end: str) -> tuple[Array, Array]:
    """Position and rotation of an end in the axes of its body."""
    end = end or (ROOT if ROOT in body.ends else "")
    if not end:
        return _ORIGIN
    return np.array(body.ends[end].position), np.array(body.ends[end].rotation)


def _twist_at_origin(position: Array, rotation: Array) -> Array:
    """Transform (6, 6) from the twist of an end of a body to that of the body's origin."""
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = rotation
    transform[:3, 3:] = _cross_matrix(position) @ rotation
    return transform


def _hinge_transform(end_position: Array, end_rotation: Array, hinge: Hinge) -> Array:
    """Transform (6, 6) from the twist of the inboard body to that of the hinge's outboard end.

    At q = 0, from the body's origin and axes to those of the hinge's outboard end; the pose is that
    of the hinge's inboard end.
    """
    lever = end_position + end_rotation @ np.array(hinge.position)
    inverse = (end_rotation @ np.array(hinge.rotation)).T
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = inverse
    transform[:3, 3:] = -inverse @ _cross_matrix(lever)
    return transform


def _own_inertia(body: Body | Beam) -> Array:
    """Spatial inertia (6, 6) of a rigid body or of a beam as a uniform rod, about its origin."""
    if isinstance(body, Beam):
        about_center = np.diag([0.0, 1.0, 1.0]) * body.mass * body.length**2 / 12
        return spatial_inertia(body.mass, np.array([body.length / 2, 0.0, 0.0]), about_center)
    return spatial_inertia(body.mass, np.array(body.center_of_mass), np.array(body.inertia_matrix))


def spatial_inertia(mass: float, center: Array, inertia: Array) -> Array:
    """Spatial inertia (6, 6) about the origin, v before w, from the inertia about the centre."""
    lever = _cross_matrix(center)
    result = np.zeros((6, 6))
    result[:3, :3] = mass * np.eye(3)
    result[:3, 3:], result[3:, :3] = -mass * lever, mass * lever
    result[3:, 3:] = inertia - mass * lever @ lever
    return result


def _cross_matrix(vector: Array) -> Array:
    """Matrix (3, 3) of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
