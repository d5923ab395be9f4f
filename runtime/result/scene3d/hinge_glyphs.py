"""Glyphs of hinges by their degrees of freedom, coils of springs, ground blocks."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import Hinge
from mstmm.scene.tables.hinge_frames import hinge_frames, initial_motion_axes

from .scene_graph import Solid
from .solid_meshes import (
    Colour,
    Surface,
    axes_along,
    box_surface,
    cylinder_surface,
    ellipsoid_surface,
    join_surfaces,
)

HINGE_COLOUR: Colour = (60, 66, 74)
GROUND_COLOUR: Colour = (120, 126, 134)
SPRING_COLOUR: Colour = (150, 110, 30)

#: Turns of a coil, points in each, and its radius relative to its greatest length.
_COIL_TURNS, _POINTS_PER_TURN, _RADIUS_TO_LENGTH = 8, 10, 0.08


def hinge_glyph(hinge: Hinge, r: float) -> Surface | None:
    """Glyph of a hinge in the axes of its outboard end; None for a free hinge. `r` in m.

    Each rotation axis is a pin, each sliding axis a square rail; three rotations are a ball, and a
    hinge without either a small block; any other hinge is a ball as well.
    """
    facts = hinge.facts
    if facts is None:
        return ellipsoid_surface((r, r, r), 8)
    if facts.free_body:
        return None
    if facts.welds:
        return box_surface((1.3 * r, 1.3 * r, 1.3 * r))
    axes = np.array(hinge_frames(hinge)[1])
    parts = []
    if len(facts.turns) == 3 or not facts.constant_subspace:
        parts.append(ellipsoid_surface((r, r, r), 16))
    else:
        parts += [
            cylinder_surface(0.75 * r, 3.2 * r).with_pose(axes=axes_along(v))
            for v in _rotation_axes(hinge)
        ]
    slides = _slide_axes(hinge)
    if len(slides) == 2:
        parts.append(box_surface((5 * r, 5 * r, 0.4 * r)).with_pose(axes=axes))
    else:
        parts += [
            box_surface((1.1 * r, 1.1 * r, 7 * r)).with_pose(axes=axes_along(v)) for v in slides
        ]
    if facts.frame == "crossing":
        parts = [
            cylinder_surface(0.6 * r, 4 * r).with_pose(axes=axes_along(v))
            for v in _crossing_axes(hinge)
        ]
    return join_surfaces(parts) if parts else ellipsoid_surface((r, r, r), 8)


def _hinge_motions(hinge: Hinge) -> list[tuple[Array, Array]]:
    """Translation and rotation of each speed at the start, axes of the outboard end."""
    return [(np.array(t), np.array(w)) for t, w in initial_motion_axes(hinge) or ()]


def _rotation_axes(hinge: Hinge) -> list[Array]:
    return [w for _, w in _hinge_motions(hinge) if np.linalg.norm(w) > 0]


def _slide_axes(hinge: Hinge) -> list[Array]:
    return [
        t for t, w in _hinge_motions(hinge) if np.linalg.norm(t) > 0 and not np.linalg.norm(w) > 0
    ]


def _crossing_axes(hinge: Hinge) -> list[Array]:
    second = hinge.unit_axis if hinge.unit_axis2 is None else hinge.unit_axis2
    return [np.array(hinge.unit_axis), np.array(second)]


def ground_block(at: Array, r: float) -> Solid:
    """Block of an attachment to the ground; `at` (3,) in m."""
    return Solid(
        "ground", "", box_surface((2.6 * r, 2.6 * r, 2.6 * r)).with_pose(at), GROUND_COLOUR
    )


def spring_coil(start: Array, end: Array, widest: float) -> Array:
    """Points (f, n, 3) of a coil between moving points (f, 3); radius at most `widest` (m)."""
    radius = min(_RADIUS_TO_LENGTH * float(np.linalg.norm(end - start, axis=1).max()), widest)
    s = np.linspace(0.0, 1.0, _COIL_TURNS * _POINTS_PER_TURN + 1)
    angle = 2 * np.pi * _COIL_TURNS * np.clip((s - 0.12) / 0.76, 0.0, 1.0)
    radii = radius * np.clip(np.minimum(s - 0.08, 0.92 - s) / 0.06, 0.0, 1.0)
    difference = end - start
    points = []
    for a, d in zip(start, difference, strict=True):
        length = np.linalg.norm(d)
        axes = axes_along(d) if length > 0 else np.eye(3)
        local = np.stack([radii * np.cos(angle), radii * np.sin(angle), s * length], axis=1)
        points.append(a + local @ axes.T)
    return np.array(points)
