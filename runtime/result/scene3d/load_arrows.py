"""Arrows of the loads on bodies and of gravity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import Load, split_reference

from ..element_quantities import AppliedLoads as Values
from ..element_quantities import inertial_components
from ..flexible import motion as observed
from .frame_times import FrameTimes
from .geometry import motion_at
from .scene_graph import DeformingSurface, ObjectLabel, Poses, SceneGraph, Solid
from .solid_meshes import Colour, Faces, Surface, circular_arrows, straight_arrows

if TYPE_CHECKING:
    from ..result_record import Record

_LOAD_COLOUR: Colour = (205, 55, 50)
_GRAVITY_COLOUR: Colour = (85, 105, 130)
#: Length of the largest force, radius of the largest moment, thickness of their arrows, relative to
#: the size of the scene; the same for gravity's arrow, and its distance from the scene.
_FORCE_LENGTH, _MOMENT_RADIUS, _SHAFT_RADIUS = 0.16, 0.08, 0.005
_GRAVITY_LENGTH, _GRAVITY_RADIUS, _GRAVITY_DISTANCE = 0.1, 0.0035, 0.05
#: Arrows of a load per length, and their length relative to one of the same force.
_ARROWS_PER_LINE_LOAD, _LINE_LOAD_SCALE = 7, 0.5


@dataclass(frozen=True)
class _LoadHistory:
    """Load at the frame times.

    Force (f, 3) N and moment (f, 3) N*m, points of action (f, 3) m, several for a load per length,
    and the axes of its end.
    """

    load: Load
    force: Array
    moment: Array
    positions: list[Array]
    pose: Poses


class LoadArrows:
    """Loads of a run at the frame times of a film; `size` (m) is that of the scene."""

    def __init__(self, run: Record, when: FrameTimes, size: float) -> None:
        self.run, self.frame_times, self.size = run, when, size
        values = Values(run._observations)
        self.histories = [
            self._load_history(load, k, values) for k, load in enumerate(run.model.scene.load)
        ]

    def _load_history(self, load: Load, number: int, values: Values) -> _LoadHistory:
        numbers = values.system.loads[number]
        wrench = np.hstack(
            [inertial_components(values, number, x) for x in (numbers.force, numbers.moment)]
        )
        wrench = self.frame_times.interpolate_linear(wrench[self.frame_times.samples])
        beams = {beam.name for beam in self.run.model.scene.beam}
        at_root = load.on in beams and load.force_per_length is None
        pose = self.frame_times.poses(self.run, f"{load.on}.root" if at_root else load.on)
        if load.at is not None:
            points = values.load(number)[0][self.frame_times.samples]
            pose = replace(
                pose, position=self.frame_times.interpolate_hermite(points[:, 0:3], points[:, 3:6])
            )
        positions = [pose.position]
        if (
            load.force_per_length is not None
            and split_reference(load.on)[0] in self.run.model.flexible_bodies
        ):
            positions = self._points_along(load, pose)
        return _LoadHistory(load, wrench[:, :3], wrench[:, 3:], positions, pose)

    def _points_along(self, load: Load, pose: Poses) -> list[Array]:
        motion = motion_at(self.run, split_reference(load.on)[0], self.frame_times, pose)
        first, last = load.span or (0.0, motion.length)
        return list(
            np.moveaxis(
                observed.deflected_axis(motion, np.linspace(first, last, _ARROWS_PER_LINE_LOAD)),
                1,
                0,
            )
        )

    def arrow_surfaces(self) -> Iterator[DeformingSurface]:
        """Arrows of forces and moments, all of one kind to one scale."""
        max_force = max((_max_norm(history.force) for history in self.histories), default=0.0)
        max_moment = max((_max_norm(history.moment) for history in self.histories), default=0.0)
        for history in self.histories:
            line_scale = 1.0 if len(history.positions) == 1 else _LINE_LOAD_SCALE
            for kind, draw, vectors, length, largest in (
                ("forces", straight_arrows, history.force, line_scale * _FORCE_LENGTH, max_force),
                ("moments", circular_arrows, history.moment, _MOMENT_RADIUS, max_moment),
            ):
                if _max_norm(vectors) > 0:
                    scaled = length * self.size / largest * vectors
                    meshes = [draw(p, scaled, _SHAFT_RADIUS * self.size) for p in history.positions]
                    yield _joined_arrows(f"{kind}/{history.load.name}", meshes)

    def poses(self) -> Iterator[tuple[str, Poses]]:
        """Owners of the labels of loads on the page, with their poses."""
        for history in self.histories:
            yield f"loads/{history.load.name}", history.pose

    def label_texts(self) -> Iterator[tuple[str, ObjectLabel]]:
        """Labels of loads on the page."""
        for history in self.histories:
            numbers = [
                (f"{kind} {x}", unit, v)
                for kind, unit, vectors in (
                    ("force", "N", history.force), ("moment", "N m", history.moment)
                )
                for x, v in zip("xyz", vectors.T, strict=True)
            ]  # fmt: skip
            nonzero = [number for number in numbers if number[2].any()]
            labels = tuple((label, unit) for label, unit, _ in nonzero)
            values = np.array([v for *_, v in nonzero]).reshape(len(nonzero), len(history.force)).T
            end_text = f", at its {history.load.at}" if history.load.at else ""
            text = (f'load on "{history.load.on}"{end_text}',)
            yield (
                f"loads/{history.load.name}",
                ObjectLabel(history.load.name, text, np.zeros(3), labels, values),
            )


def _max_norm(vectors: Array) -> float:
    return float(np.linalg.norm(np.nan_to_num(vectors), axis=1).max(initial=0.0))


def _joined_arrows(name: str, drawn: list[tuple[Array, Faces]]) -> DeformingSurface:
    starts = np.cumsum([0, *(vertices.shape[1] for vertices, _ in drawn)])
    faces = [faces + start for (_, faces), start in zip(drawn, starts, strict=False)]
    vertices = np.concatenate([np.nan_to_num(vertices) for vertices, _ in drawn], axis=1)
    return DeformingSurface(name, vertices, np.concatenate(faces), _LOAD_COLOUR)


def gravity_arrow(stage: SceneGraph, strength: float) -> tuple[Solid, ObjectLabel] | None:
    """Downward arrow next to everything that is drawn; None without gravity (m/s2)."""
    if not strength > 0:
        return None
    low, high = stage.corners()
    up, size = stage.up, stage.size
    horizontal_extent = np.abs(high - low) - np.abs(up) * np.abs(high - low)
    direction = np.eye(3)[int(np.argmax(horizontal_extent))]
    direction = direction - (direction @ up) * up
    direction = direction / np.linalg.norm(direction)
    cloud_distance = float(((stage.cloud - low) @ direction).min())
    position = (low + high) / 2
    position = (
        position
        + (cloud_distance - (position - low) @ direction - _GRAVITY_DISTANCE * size) * direction
        + _GRAVITY_LENGTH / 2 * size * up
    )
    vertices, faces = straight_arrows(
        position[None], -_GRAVITY_LENGTH * size * up[None], _GRAVITY_RADIUS * size
    )
    arrow = Solid("gravity", "arrow", Surface(vertices[0], faces), _GRAVITY_COLOUR)
    return arrow, ObjectLabel(
        "gravity", (f"{strength:.6g} m/s2",), position - _GRAVITY_LENGTH / 2 * size * up
    )
