"""Motion and inertia of what carries the inboard end of a flexible body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.checks.flexible_bodies import free_axes
from mstmm.scene.checks.topology import inboard_hinges_by_body
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
        self._released = {event.hinge for event in scene.event if event.hinge}

    def support_of(self, name: str) -> Support:
        """Support of a flexible body: its inboard hinge and rigid bodies.

        They are followed up to the ground or to another flexible body.
        """
        hinge = self._inboard_hinges.get(name)
        return ANY if hinge is None else self._hinge_support(hinge)

    def _hinge_support(self, hinge: Hinge, followed: int = 0) -> Support:
        """Support at the outboard end of a hinge, its axes, `followed` bodies inboard."""
        motions = self._free_motions(hinge)
        if motions is None or followed > _MAX_BODIES:
            return ANY
        inboard = self._body_support(hinge.inboard_body, followed)
        transform = _hinge_transform(self._bodies.get(hinge.inboard_body), hinge)
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
        inertia = support.motion.T @ _spatial_inertia(body) @ support.motion
        return Support(support.motion, support.inertia + inertia)

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


def _hinge_transform(body: Body | None, hinge: Hinge) -> Array:
    """Transform (6, 6) from the twist of the inboard body to that of the hinge's outboard end.

    At q = 0, from the body's origin and axes to those of the end.  Without a rigid body only the
    axes change, because its support allows any motion.
    """
    end_rotation = np.eye(3) if body is None else np.array(body.end_rotation(hinge.inboard_end))
    end_position = np.zeros(3) if body is None else np.array(body.end_position(hinge.inboard_end))
    lever = end_position + end_rotation @ np.array(hinge.position)
    inverse = (end_rotation @ np.array(hinge.rotation)).T
    transform = np.zeros((6, 6))
    transform[:3, :3] = transform[3:, 3:] = inverse
    transform[:3, 3:] = -inverse @ _cross_matrix(lever)
    return transform


def _spatial_inertia(body: Body) -> Array:
    """Spatial inertia (6, 6) of a rigid body about its origin, its axes."""
    lever = _cross_matrix(np.array(body.center_of_mass))
    inertia = np.zeros((6, 6))
    inertia[:3, :3] = body.mass * np.eye(3)
    inertia[:3, 3:], inertia[3:, :3] = -body.mass * lever, body.mass * lever
    inertia[3:, 3:] = np.array(body.inertia_matrix) - body.mass * lever @ lever
    return inertia


def _cross_matrix(vector: Array) -> Array:
    """Matrix (3, 3) of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
