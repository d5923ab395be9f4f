"""Euler angles of orientations: rotations about z, then the new y, then the newest x.

Of a rotation R = Rz(yaw) Ry(pitch) Rx(roll), body to inertial or outboard to inboard axes.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from ...engine.quantity_registry import QuantityKind

#: Yaw and roll are continuous, pitch is within +-pi/2.
EULER_KIND = QuantityKind(
    "rad", "Euler angles about z, y', x''", ("yaw", "pitch", "roll"), ("yaw", "pitch", "roll")
)

#: Values of cos(pitch) below which yaw and roll coincide, and below which they vary rapidly.
_MIN_COS_PITCH, _MAX_WARNED_COS_PITCH = 1e-7, 0.05


def euler_angles(matrices: Array) -> Array:
    """Euler angles (n, 3), yaw, pitch, roll, of rotation matrices (n, 9), row by row.

    Continuous over the rows if neighbours differ by less than half a turn. Where the pitch is
    +-pi/2 only yaw -+ roll is known: the roll stays that of the previous row.
    """
    r = matrices.reshape(-1, 3, 3)
    cos_pitch = np.hypot(r[:, 0, 0], r[:, 1, 0])
    pitch = np.arctan2(-r[:, 2, 0], cos_pitch)
    yaw, roll = np.arctan2(r[:, 1, 0], r[:, 0, 0]), np.arctan2(r[:, 2, 1], r[:, 2, 2])
    for k in np.flatnonzero(cos_pitch < _MIN_COS_PITCH):
        roll[k] = roll[k - 1] if k else 0.0
        yaw_sum = np.arctan2(-r[k, 0, 1], r[k, 1, 1])
        yaw[k] = yaw_sum + roll[k] if pitch[k] > 0 else yaw_sum - roll[k]
    return np.stack([_unwrap(yaw), pitch, _unwrap(roll)], axis=1)


def _unwrap(angles: Array) -> Array:
    """Angles without jumps by full turns, over the rows with known values."""
    is_finite = np.isfinite(angles)
    angles = angles.copy()
    angles[is_finite] = np.unwrap(angles[is_finite])
    return angles


def gimbal_note(angles: Array) -> str:
    """Note where yaw and roll are poorly distinguished; "" otherwise."""
    cos_pitch = np.cos(angles[:, 1])
    near_samples = np.flatnonzero(cos_pitch < _MAX_WARNED_COS_PITCH)
    if not len(near_samples):
        return ""
    worst = int(near_samples[np.argmin(cos_pitch[near_samples])])
    offset_deg = np.degrees(np.arccos(min(1.0, float(np.sin(abs(angles[worst, 1]))))))
    return (
        f"pitch comes within {offset_deg:.2g} deg of 90 deg (sample {worst}): yaw and roll "
        "are ill-conditioned there; use the orientation instead"
    )


def rotation_matrices(q: Array) -> Array:
    """Rotation matrices (n, 9), row by row, of unit quaternions (n, 4), w, x, y, z."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(rows, axis=1)
