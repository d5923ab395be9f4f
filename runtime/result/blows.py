"""Momentum components that the impacts of a run conserve.

A blow between bodies of a scene changes nothing of the momentum of all; one against the world, such
as a ball's on its floor, does.  Linear momentum along an axis is kept where the scene can be moved
along it as one rigid body, hinges on the ground allowing, and what the blow strikes does not come
nearer by that; angular momentum where it can be turned.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import Hinge

from ..engine.code import NotFused
from ..engine.states.kinematics import Kinematics
from ..run.system import SceneSystem
from .record import Record

#: Parts of a motion, and of the terms of a rate, that count as zero.
_ZERO = 1e-9


def kept_by_blows(
    result: Record, roots: Sequence[Hinge], pivot: Array, asked: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Those components (6,) of what is `asked` that the blows of a run leave as they are: linear
    momentum along each axis, then angular momentum about `pivot` (3,) in m; `roots` are the hinges
    on the ground."""
    kept, blows = asked.copy(), _blows(result)
    if blows is None:
        return np.zeros_like(asked)
    if blows and kept.any():
        scene = _Whole(result, roots, pivot)
        for row, event in blows:
            kept &= scene.untouched(row, event, kept)
            if not kept.any():
                break
    return kept


def is_struck(result: Record) -> bool:
    """Whether a run has impacts; True also where output times may hide them."""
    blows = _blows(result)
    return blows is None or bool(blows)


def _blows(result: Record) -> list[tuple[int, int]] | None:
    """(sample, event) of every impact; None where samples may not show all of them."""
    thrown = {bounce.event for bounce in result.model.packed.watched.bounces}
    rows = np.flatnonzero(result.event > 0).tolist()
    count = result.statistics
    if thrown and (count is None or len(rows) < count.events):
        return None
    return [(k, event) for k in rows if (event := int(result.event[k]) - 1) in thrown]


class _Whole:
    """Scene moved as one rigid body at samples of a run."""

    def __init__(self, result: Record, roots: Sequence[Hinge], pivot: Array) -> None:
        self._result, self._system = result, SceneSystem(result.model.looped)
        self._speeds = [result.layout(hinge.name).u_slice for hinge in roots]
        self._names = [hinge.outboard for hinge in roots]
        self._arms = [result.position(name) - pivot for name in self._names]
        references = result._observed.references
        self._kinematics = Kinematics(result.model.looped, NotFused(), references, lambda: None)

    def untouched(self, row: int, event: int, asked: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Those of the `asked` axes (6,) along and about which the scene can be moved, so that what
        an event strikes stays as far away."""
        speeds, allowed = self._rigid(row)
        left = asked & allowed
        try:
            left[left] = self._stays(row, event, speeds[left], self._sizes(row)[left])
        except NumericalFailure:
            left[:] = False
        return left

    def _rigid(self, row: int) -> tuple[Array, NDArray[np.bool_]]:
        """Speeds (6, nu) of the scene's motions as one body, and which of them (6,) its hinges on
        the ground allow."""
        speeds, allowed = np.zeros((6, self._result.model.nu)), np.ones(6, dtype=bool)
        found = self._kinematics.jacobian(self._names, np.array(self._result.q[row]))
        for own, arms, jacobian in zip(self._speeds, self._arms, found, strict=True):
            wanted, ways = _twists(arms[row]), jacobian[:, own]
            speeds[:, own] = (np.linalg.pinv(ways) @ wanted).T
            missing = np.linalg.norm(ways @ speeds[:, own].T - wanted, axis=0)
            allowed &= missing <= _ZERO * np.linalg.norm(wanted, axis=0)
        return speeds, allowed

    def _sizes(self, row: int) -> Array:
        """Speeds (6,) in m/s of the scene's motions, by the bodies on its hinges on the ground."""
        far = max((float(np.linalg.norm(arms[row])) for arms in self._arms), default=0.0)
        return np.array([1.0, 1.0, 1.0, far, far, far])

    def _stays(self, row: int, event: int, motions: Array, sizes: Array) -> list[bool]:
        """Whether an event's value does, at one sample, by each of these speeds (n, nu)."""
        run, system = self._result.trajectory, self._system
        system.memory[:] = run.memory[row]
        t, y = float(run.t[row]), np.concatenate([run.q[row], run.u[row]])
        still = system.meeting(event, t, y, np.zeros(motions.shape[1])).rate
        moved = [system.meeting(event, t, y, u) for u in motions]
        return [
            abs(one.rate - still) <= _ZERO * (one.size + one.steepness * size)
            for one, size in zip(moved, sizes, strict=True)
        ]


def _twists(arm: Array) -> Array:
    """(6, 6) velocity and angular velocity, as columns, of a point at `arm` (3,) in m from a pivot
    where all moves along each axis by 1 m/s, and turns about each by 1 rad/s."""
    unit = np.eye(3)
    return np.block([[unit, np.cross(unit, arm).T], [np.zeros((3, 3)), unit]])
