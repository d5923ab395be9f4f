"""Rotations of a section that its hinge constrains."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.tables.hinge_frames import initial_motion_axes

if TYPE_CHECKING:
    from mstmm.scene import Hinge


def constrained_rotations(hinge: Hinge, rotation: Array, unknown: Array) -> Array:
    """Projection (3, 3) of rotations onto those that a hinge constrains, in body axes.

    `rotation` are the axes of its outboard end in those of the body.  `unknown` is returned for
    hinges whose free axes rotate.  Driven coordinates are constrained.
    """
    motions, facts = initial_motion_axes(hinge), hinge.facts
    if facts is None or motions is None:
        return unknown
    drive = hinge.drive or (None,) * len(motions)
    free = [k for k in facts.turns if drive[k] is None]
    if not free:
        return np.eye(3)
    if len(free) >= 3:
        return np.zeros((3, 3))
    if len(free) > 1 or "q" in facts.varies[free[0]][3:]:
        return unknown
    axis = rotation @ np.array(motions[free[0]][1])
    axis /= np.linalg.norm(axis)
    return np.eye(3) - np.outer(axis, axis)
