"""Projection of a scene at one time: triangles by depth, with lines over them (extra: plot)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mstmm.array_validation import Array

from .camera import Camera, choose_camera
from .scene_graph import SceneGraph
from .solid_meshes import Colour, Faces

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
