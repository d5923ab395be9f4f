"""From where a stage is looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.arrays import Array

from .stage import Stage

#: Opening of the camera upright, rad, its width by its height, and room for the edges.
FIELD, _WIDE, _ROOM = np.deg2rad(38.0), 1.3, 1.15
#: Spread across a plane beside that within it up to which a motion is plane.
_FLAT = 0.02


@dataclass(frozen=True)
class Camera:
    """Where it is and what it looks at, (3,) m, and which way is up."""

    position: Array
    look_at: Array
    up: Array

    @property
    def axes(self) -> Array:
        """(3, 3) rows: to the right, up and towards the camera."""
        back = self.position - self.look_at
        back = back / np.linalg.norm(back)
        right = np.cross(self.up, back)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(back, right), back])


def camera(stage: Stage) -> Camera:
    """All in sight: a motion in a plane is seen almost along its normal, any other from aside and
    above."""
    toward = _toward(stage)
    up = _upright(stage.up, toward)
    axes = Camera(toward, np.zeros(3), up).axes
    seen = stage.cloud @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    x, y, z = (seen - middle).T
    half = np.tan(FIELD / 2)
    distance = _ROOM * float(np.max(z + np.maximum(abs(x) / (_WIDE * half), abs(y) / half)))
    distance = max(distance, 1e-9)
    target = middle @ axes
    return Camera(target + distance * toward, target, up)


def _toward(stage: Stage) -> Array:
    """Unit vector from what is looked at to the camera."""
    up = stage.up
    side, ahead = _level(up)
    clouds = [pose.position[:: max(1, len(pose.position) // 40)] for pose in stage.poses.values()]
    cloud = np.concatenate(clouds) if clouds else np.zeros((1, 3))
    cloud = cloud - cloud.mean(axis=0)
    squares, axes = np.linalg.eigh(cloud.T @ cloud)  # ascending
    if squares[1] > 0 and squares[0] <= _FLAT**2 * squares[1]:
        normal = axes[:, 0]
        normal = normal * (1.0 if normal[int(np.argmax(np.abs(normal)))] > 0 else -1.0)
        way = normal + 0.28 * up + 0.22 * np.cross(up, normal)
    else:
        way = 0.55 * ahead + 0.85 * side + 0.5 * up
    return np.asarray(way / np.linalg.norm(way))


def _level(up: Array) -> tuple[Array, Array]:
    """Two unit vectors normal to up: the inertial axes where it is one of them."""
    k = int(np.argmax(np.abs(up)))
    first = np.eye(3)[(k + 1) % 3]
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    return first, np.cross(up, first)


def _upright(up: Array, toward: Array) -> Array:
    """Up, unless the camera looks along it."""
    return up if abs(up @ toward) < 0.98 else _level(up)[0]
