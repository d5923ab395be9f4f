"""Camera position and direction for a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from .scene_graph import SceneGraph

#: Vertical field of view of the camera in rad, aspect ratio (width by height), and margin.
FIELD_OF_VIEW, _ASPECT_RATIO, _FRAME_MARGIN = np.deg2rad(38.0), 1.3, 1.15
#: Largest ratio of out-of-plane to in-plane spread of a planar motion.
_MAX_PLANE_RATIO = 0.02


@dataclass(frozen=True)
class Camera:
    """Position of the camera, point that it looks at, (3,) m, and upward direction."""

    position: Array
    look_at: Array
    up: Array

    @property
    def axes(self) -> Array:
        """Axes (3, 3) as rows: to the right, up and towards the camera."""
        view_direction = self.position - self.look_at
        view_direction = view_direction / np.linalg.norm(view_direction)
        right = np.cross(self.up, view_direction)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(view_direction, right), view_direction])


def choose_camera(stage: SceneGraph) -> Camera:
    """Choose a camera that shows everything.

    A planar motion is viewed almost along its normal, any other obliquely from above.
    """
    view_direction = _view_direction(stage)
    up = _camera_up(stage.up, view_direction)
    axes = Camera(view_direction, np.zeros(3), up).axes
    camera_coordinates = stage.cloud @ axes.T
    middle = (camera_coordinates.min(axis=0) + camera_coordinates.max(axis=0)) / 2
    x, y, z = (camera_coordinates - middle).T
    half = np.tan(FIELD_OF_VIEW / 2)
    distance = _FRAME_MARGIN * float(
        np.max(z + np.maximum(abs(x) / (_ASPECT_RATIO * half), abs(y) / half))
    )
    distance = max(distance, 1e-9)
    target = middle @ axes
    return Camera(target + distance * view_direction, target, up)


def _view_direction(stage: SceneGraph) -> Array:
    """Unit vector from the viewed point to the camera."""
    up = stage.up
    side_direction, ahead_direction = _horizontal_axes(up)
    clouds = [pose.position[:: max(1, len(pose.position) // 40)] for pose in stage.poses.values()]
    cloud = np.concatenate(clouds) if clouds else np.zeros((1, 3))
    cloud = cloud - cloud.mean(axis=0)
    squares, axes = np.linalg.eigh(cloud.T @ cloud)  # ascending
    if squares[1] > 0 and squares[0] <= _MAX_PLANE_RATIO**2 * squares[1]:
        normal = axes[:, 0]
        normal = normal * (1.0 if normal[int(np.argmax(np.abs(normal)))] > 0 else -1.0)
        direction = normal + 0.28 * up + 0.22 * np.cross(up, normal)
    else:
        direction = 0.55 * ahead_direction + 0.85 * side_direction + 0.5 * up
    return np.asarray(direction / np.linalg.norm(direction))


def _horizontal_axes(up: Array) -> tuple[Array, Array]:
    """Two unit vectors normal to up: the inertial axes if up is one of them."""
    k = int(np.argmax(np.abs(up)))
    first = np.eye(3)[(k + 1) % 3]
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    return first, np.cross(up, first)


def _camera_up(up: Array, toward: Array) -> Array:
    """Upward direction, replaced if the camera looks along it."""
    return up if abs(up @ toward) < 0.98 else _horizontal_axes(up)[0]
