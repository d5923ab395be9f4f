"""Camera of a scene, and its projection at one time: triangles by depth, lines over them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from .scene_graph import SceneGraph
from .solid_meshes import Colour, Faces

# --- camera ---------------------------------------------------------------------------------------

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


# --- projection (extra: plot) ---------------------------------------------------------------------

#: Direction to the light: right, up and towards the camera; and the ambient light.
_LIGHT_DIRECTION, _AMBIENT_LIGHT = np.array([0.3, 0.75, 0.6]), 0.45
_PAPER, _FAINT = "#ffffff", "#d9dde2"


@dataclass(frozen=True)
class ProjectedFrame:
    """Parallel projection of a scene, so that lengths can be compared.

    The camera and the window are those of `full_scene`, of which the scene may be a part.
    """

    stage: SceneGraph
    full_scene: SceneGraph | None = None

    @cached_property
    def camera(self) -> Camera:
        return choose_camera(self.full_scene or self.stage)

    @cached_property
    def window(self) -> tuple[Array, Array]:
        """Least and largest (right, up) in m shown in all frames."""
        plane_points = ((self.full_scene or self.stage).cloud @ self.camera.axes.T)[:, :2]
        low, high = plane_points.min(axis=0), plane_points.max(axis=0)
        margin = 0.04 * max(float((high - low).max()), 1e-9)
        return low - margin, high + margin

    @property
    def shape(self) -> float:
        """Height of the window by its width, limited to the size of a page."""
        low, high = self.window
        width, height = high - low
        return float(np.clip(height / width, 0.2, 4.0))

    def draw(self, axis: Any, k: int) -> None:
        """Draw frame k into matplotlib axes."""
        from matplotlib.collections import LineCollection, PolyCollection

        corners, colours = self._triangles(k)
        axis.add_collection(
            PolyCollection(
                list(corners), facecolors=colours, edgecolors=colours, linewidths=0.3,
                antialiased=True,
            )
        )  # fmt: skip
        for line in self.stage.lines:
            points = line.points_at(k, len(self.stage.times)) @ self.camera.axes.T
            colour = tuple(c / 255 for c in line.colour)
            axis.add_collection(LineCollection([points[:, :2]], colors=[colour], linewidths=0.9))
        low, high = self.window
        axis.set_xlim(low[0], high[0])
        axis.set_ylim(low[1], high[1])
        axis.set_aspect("equal")
        axis.set_axis_off()

    def _triangles(self, k: int) -> tuple[Array, Array]:
        """Corners (n, 3, 2) and colours (n, 4) of visible triangles, farthest first.

        Visible are the triangles that face the camera.
        """
        parts = [self._facing(*part) for part in self._surfaces(k)]
        corners = np.concatenate([part[0] for part in parts]) if parts else np.zeros((0, 3, 3))
        colours = np.concatenate([part[1] for part in parts]) if parts else np.zeros((0, 4))
        order = np.argsort(corners[:, :, 2].mean(axis=1), kind="stable")
        return corners[order][:, :, :2], colours[order]

    def _surfaces(self, k: int) -> Any:
        """Inertial vertices, faces, colour and opacity of everything in frame k."""
        rotations = {owner: pose.pose_at(k) for owner, pose in self.stage.poses.items()}
        for solid in self.stage.solids:
            if not solid.hidden:
                vertices = solid.surface.vertices
                if solid.owner in rotations:
                    position, axes = rotations[solid.owner]
                    vertices = position + vertices @ axes.T
                yield vertices, solid.surface.faces, solid.colour, solid.opacity
        for bent in self.stage.deforming_surfaces:
            yield bent.vertices[k], bent.faces, bent.colour, 1.0

    def _facing(
        self, vertices: Array, faces: Faces, colour: Colour, opacity: float
    ) -> tuple[Array, Array]:
        corners = (vertices @ self.camera.axes.T)[faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        lengths = np.linalg.norm(normals, axis=1)
        is_visible = normals[:, 2] > 1e-12 * lengths
        normals = normals[is_visible] / lengths[is_visible, None]
        light = np.clip(normals @ (_LIGHT_DIRECTION / np.linalg.norm(_LIGHT_DIRECTION)), 0.0, 1.0)
        brightness = (_AMBIENT_LIGHT + (1.15 - _AMBIENT_LIGHT) * light)[:, None]
        shade = np.clip(brightness * np.array(colour) / 255, 0.0, 1.0)
        return corners[is_visible], np.column_stack([shade, np.full(len(shade), opacity)])
