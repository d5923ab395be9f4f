"""Momentum components that the impacts of a run conserve.

An impact between bodies of a scene does not change the total momentum; an impact against the
ground, such as that of a ball on the floor, does. Linear momentum along an axis is conserved if the
scene can translate along it as one rigid body, as its hinges on the ground permit, without changing
the distance to the struck object; angular momentum if it can rotate about the axis in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import Hinge

from ...engine.fused_code import NoFusedCode
from ...engine.state_evaluation.kinematics import Kinematics
from ...run.scene_system import SceneSystem
from ..result_record import Record

#: Relative size of motions, and of the terms of a rate, that count as zero.
_ZERO_RATIO = 1e-9


def momentum_kept_by_impacts(
    result: Record, roots: Sequence[Hinge], pivot: Array, is_requested: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Mask (6,) of the components in `is_requested` that the impacts of a run conserve.

    Linear momentum along each axis, then angular momentum about `pivot` (3,) in m; `roots` are the
    hinges on the ground.
    """
    kept, impacts = is_requested.copy(), _impact_samples(result)
    if impacts is None:
        return np.zeros_like(is_requested)
    if impacts and kept.any():
        scene = _RigidScene(result, roots, pivot)
        for row, event in impacts:
            kept &= scene.rigid_motion_axes(row, event, kept)
            if not kept.any():
                break
    return kept


def has_impacts(result: Record) -> bool:
    """Whether a run has impacts; True also where output times may hide them."""
    impacts = _impact_samples(result)
    return impacts is None or bool(impacts)


def _impact_samples(result: Record) -> list[tuple[int, int]] | None:
    """Pairs (sample, event) of all impacts; None if samples may not show all of them."""
    bounce_events = {bounce.event for bounce in result.model.packed_scene.event_functions.bounces}
    rows = np.flatnonzero(result.event > 0).tolist()
    statistics = result.statistics
    if bounce_events and (statistics is None or len(rows) < statistics.events):
        return None
    return [(k, event) for k in rows if (event := int(result.event[k]) - 1) in bounce_events]


class _RigidScene:
    """Scene moved as one rigid body at samples of a run."""

    def __init__(self, result: Record, roots: Sequence[Hinge], pivot: Array) -> None:
        self._result, self._system = result, SceneSystem(result.model.looped)
        self._speeds = [result.coordinate_info(hinge.name).u_slice for hinge in roots]
        self._names = [hinge.outboard for hinge in roots]
        self._arms = [result.position(name) - pivot for name in self._names]
        references = result._observations.references
        self._kinematics = Kinematics(result.model.looped, NoFusedCode(), references, lambda: None)

    def rigid_motion_axes(
        self, row: int, event: int, is_requested: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Mask of the `is_requested` axes (6,) along and about which the scene can move rigidly.

        The motion must not change the distance to the object of the event.
        """
        speeds, allowed = self._rigid_motions(row)
        remaining = is_requested & allowed
        try:
            remaining[remaining] = self._is_constant(
                row, event, speeds[remaining], self._sizes(row)[remaining]
            )
        except NumericalFailure:
            remaining[:] = False
        return remaining

    def _rigid_motions(self, row: int) -> tuple[Array, NDArray[np.bool_]]:
        """Speeds (6, nu) of the scene's rigid motions, and mask (6,) of those permitted.

        Permitted are motions that the hinges on the ground allow.
        """
        speeds, allowed = np.zeros((6, self._result.model.nu)), np.ones(6, dtype=bool)
        jacobians = self._kinematics.jacobian(self._names, np.array(self._result.q[row]))
        for speed_slice, arms, jacobian in zip(self._speeds, self._arms, jacobians, strict=True):
            twists, columns = _twists(arms[row]), jacobian[:, speed_slice]
            speeds[:, speed_slice] = (np.linalg.pinv(columns) @ twists).T
            residuals = np.linalg.norm(columns @ speeds[:, speed_slice].T - twists, axis=0)
            allowed &= residuals <= _ZERO_RATIO * np.linalg.norm(twists, axis=0)
        return speeds, allowed

    def _sizes(self, row: int) -> Array:
        """Speeds (6,) in m/s of the scene's rigid motions, at the bodies on ground hinges."""
        max_arm = max((float(np.linalg.norm(arms[row])) for arms in self._arms), default=0.0)
        return np.array([1.0, 1.0, 1.0, max_arm, max_arm, max_arm])

    def _is_constant(self, row: int, event: int, motions: Array, sizes: Array) -> list[bool]:
        """Whether an event's value is constant at one sample, for each of the speeds (n, nu)."""
        run, system = self._result.trajectory, self._system
        system.memory[:] = run.memory[row]
        t, y = float(run.t[row]), np.concatenate([run.q[row], run.u[row]])
        rest_rate = system.approach_rate(event, t, y, np.zeros(motions.shape[1])).rate
        approaches = [system.approach_rate(event, t, y, u) for u in motions]
        return [
            abs(approach.rate - rest_rate)
            <= _ZERO_RATIO * (approach.size + approach.steepness * scale)
            for approach, scale in zip(approaches, sizes, strict=True)
        ]


def _twists(arm: Array) -> Array:
    """Velocity and angular velocity (6, 6), as columns, of a point at `arm` (3,) in m.

    From a pivot, for translations along each axis by 1 m/s and rotations about each by 1 rad/s.
    """
    unit = np.eye(3)
    return np.block([[unit, np.cross(unit, arm).T], [np.zeros((3, 3)), unit]])
