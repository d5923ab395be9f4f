"""What the held end of a flexible body rides on: the ground, a rigid body, or anything."""

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
    """The twist (v, w; end axes) of the held end is `motion` (6, m) times m speeds, which have an
    inertia (m, m) of their own: kg, kg m, kg m^2."""

    motion: Array
    inertia: Array

    @property
    def speeds(self) -> int:
        """m."""
        return int(self.motion.shape[1])


#: An end that may move in any way, with nothing that is known to move with it.
ANY = Support(np.eye(6), np.zeros((6, 6)))
#: An end whose motion is prescribed.
RESTING = Support(np.zeros((6, 0)), np.zeros((0, 0)))

#: Rigid bodies inboard that are followed; those beyond may move in any way.
_MOST = 6


class Supports:
    """The supports of the flexible bodies of a scene."""

    def __init__(self, scene: Scene) -> None:
        self._holds = inboard_hinges_by_body(scene)
        self._bodies = {body.name: body for body in scene.body if body.type == "rigid"}
        self._let_go = {event.hinge for event in scene.event if event.hinge}

    def of(self, name: str) -> Support:
        """The support of a flexible body: hinge and rigid bodies inboard, up to the ground or to
        another flexible body."""
        hinge = self._holds.get(name)
        return ANY if hinge is None else self._behind(hinge)

    def _behind(self, hinge: Hinge, followed: int = 0) -> Support:
        """The outboard end of a hinge, its axes; `followed` bodies outboard of it are known."""
        own = self._own_motion(hinge)
        if own is None or followed > _MOST:
            return ANY
        inboard = self._body(hinge.inboard_body, followed)
        carried = _to_hinge(self._bodies.get(hinge.inboard_body), hinge) @ inboard.motion
        return Support(
            np.concatenate([carried, own], axis=1),
            _diagonal(inboard.inertia, _rotors(hinge, own)),
        )

    def _body(self, name: str, followed: int) -> Support:
        """The origin of a rigid body, its axes, with the inertia of the body."""
        if name == GROUND:
            return RESTING
        body, hinge = self._bodies.get(name), self._holds.get(name)
        if body is None:
            return ANY
        ridden = ANY if hinge is None or hinge.outboard_end else self._behind(hinge, followed + 1)
        own = ridden.motion.T @ _inertia(body) @ ridden.motion
        return Support(ridden.motion, ridden.inertia + own)

    def _own_motion(self, hinge: Hinge) -> Array | None:
        """(6, m) free motions of a hinge, outboard axes; None where they are not known."""
        if hinge.lets_go or hinge.name in self._let_go:
            return None
        if _prescribed(hinge):
            return np.zeros((6, 0))
        facts, motions = hinge.facts, initial_motion_axes(hinge)
        if facts is None or motions is None or not facts.in_place:
            return None
        if facts.slides and (facts.turns or not facts.steady):
            return None
        if facts.slides:
            along = np.array([translation for translation, _ in motions]).T
            return np.concatenate([along, np.zeros_like(along)])
        axes = np.array(free_axes(hinge)).reshape(-1, 3).T
        return np.concatenate([np.zeros_like(axes), axes])


def _prescribed(hinge: Hinge) -> bool:
    driven = hinge.drive is not None and all(entry is not None for entry in hinge.drive)
    return hinge.is_weld or driven


def _rotors(hinge: Hinge, motion: Array) -> Array:
    """(m, m) inertia of the rotors of a hinge, where they belong to its free motions one by one."""
    given = np.array(hinge.law.inertia, dtype=float)
    return np.diag(given if len(given) == motion.shape[1] else np.zeros(motion.shape[1]))


def _diagonal(one: Array, other: Array) -> Array:
    both = np.zeros((len(one) + len(other),) * 2)
    both[: len(one), : len(one)], both[len(one) :, len(one) :] = one, other
    return both


def _to_hinge(body: Body | None, hinge: Hinge) -> Array:
    """(6, 6) twist of the outboard end of a hinge at q = 0, its axes, from that of the body inboard
    at its origin; of what is no rigid body only the axes change, for it moves anyhow."""
    end = np.eye(3) if body is None else np.array(body.end_rotation(hinge.inboard_end))
    place = np.zeros(3) if body is None else np.array(body.end_position(hinge.inboard_end))
    lever = place + end @ np.array(hinge.position)
    back = (end @ np.array(hinge.rotation)).T
    moved = np.zeros((6, 6))
    moved[:3, :3] = moved[3:, 3:] = back
    moved[:3, 3:] = -back @ _cross(lever)
    return moved


def _inertia(body: Body) -> Array:
    """(6, 6) inertia of a rigid body about its origin, its axes."""
    lever = _cross(np.array(body.center_of_mass))
    whole = np.zeros((6, 6))
    whole[:3, :3] = body.mass * np.eye(3)
    whole[:3, 3:], whole[3:, :3] = -body.mass * lever, body.mass * lever
    whole[3:, 3:] = np.array(body.inertia_matrix) - body.mass * lever @ lever
    return whole


def _cross(vector: Array) -> Array:
    """(3, 3) matrix of the cross product with a vector."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
