"""Euler angles of orientations: turned about z, then about the new y, then about the newest x.

Of a rotation R = Rz(yaw) Ry(pitch) Rx(roll), body to inertial or outboard to inboard axes.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array

from ...engine.shown import Kind

#: Yaw and roll are continuous, pitch is within +-pi/2.
EULER = Kind(
    "rad", "Euler angles about z, y', x''", ("yaw", "pitch", "roll"), ("yaw", "pitch", "roll")
)

#: cos(pitch) below which yaw and roll are one and the same turn, and below which they swing.
_LOCKED, _NEAR = 1e-7, 0.05


def euler(matrices: Array) -> Array:
    """(n, 3): yaw, pitch, roll of rotation matrices (n, 9), row by row; continuous over the rows as
    long as neighbours are less than half a turn apart.

    Where the pitch is +-pi/2 only yaw -+ roll is known: the roll stays that of the row before.
    """
    r = matrices.reshape(-1, 3, 3)
    level = np.hypot(r[:, 0, 0], r[:, 1, 0])
    pitch = np.arctan2(-r[:, 2, 0], level)
    yaw, roll = np.arctan2(r[:, 1, 0], r[:, 0, 0]), np.arctan2(r[:, 2, 1], r[:, 2, 2])
    for k in np.flatnonzero(level < _LOCKED):
        roll[k] = roll[k - 1] if k else 0.0
        turned = np.arctan2(-r[k, 0, 1], r[k, 1, 1])
        yaw[k] = turned + roll[k] if pitch[k] > 0 else turned - roll[k]
    return np.stack([_unwrapped(yaw), pitch, _unwrapped(roll)], axis=1)


def _unwrapped(angles: Array) -> Array:
    """Without jumps by full turns, over the rows that are known."""
    known = np.isfinite(angles)
    angles = angles.copy()
    angles[known] = np.unwrap(angles[known])
    return angles


def gimbal(angles: Array) -> str:
    """A sentence where yaw and roll are told apart badly; "" where they are not."""
    level = np.cos(angles[:, 1])
    near = np.flatnonzero(level < _NEAR)
    if not len(near):
        return ""
    worst = int(near[np.argmin(level[near])])
    off = np.degrees(np.arccos(min(1.0, float(np.sin(abs(angles[worst, 1]))))))
    return (
        f"pitch comes within {off:.2g} deg of 90 deg (sample {worst}): yaw and roll swing there, "
        "whatever the motion; take the orientation instead"
    )


def matrices(q: Array) -> Array:
    """Rotation matrices (n, 9), row by row, of unit quaternions (n, 4), w, x, y, z."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(rows, axis=1)
