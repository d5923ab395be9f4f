"""Arrows with a length proportional to a vector: straight for forces, circular for moments."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from .solid_meshes import Faces, axes_along, tube_faces

#: Corners around the shaft; radius and length of the head, relative to the radius of the shaft.
_CORNERS_AROUND, _HEAD_RADIUS_RATIO, _HEAD_LENGTH_RATIO = 10, 2.4, 6.0
#: Shafts of short arrows are thinner: at most this part of the length, or of the radius of a
#: circular arrow.
_MAX_RADIUS_TO_LENGTH, _MAX_RADIUS_TO_TURN_RADIUS = 0.1, 0.22
#: Angle of a circular arrow, and sections of its shaft.
_TURN_ANGLE, _SHAFT_SECTIONS = 1.5 * np.pi, 16


def straight_arrows(at: Array, vector: Array, thick: float) -> tuple[Array, Faces]:
    """Vertices (f, n, 3) and faces of straight arrows from points (f, 3) along vectors (f, 3).

    Lengths in m; `thick` (m) is the radius of a shaft.
    """
    length = np.linalg.norm(vector, axis=1)
    r = np.minimum(thick, _MAX_RADIUS_TO_LENGTH * length)
    neck = length - _HEAD_LENGTH_RATIO * r
    z = np.stack([0 * length, 0 * length, neck, neck, length], axis=1)
    centres = z[:, :, None] * np.array([0.0, 0.0, 1.0])
    radii = r[:, None] * np.array([0.0, 1.0, 1.0, _HEAD_RADIUS_RATIO, 0.0])
    first, second = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    return _place_rings(_arrow_rings(centres, radii, first, second), at, vector), _arrow_faces(5)


def circular_arrows(at: Array, vector: Array, thick: float) -> tuple[Array, Faces]:
    """Vertices (f, n, 3) and faces of circular arrows about points (f, 3).

    Each arrow turns about its vector (f, 3), right-handed, with the vector's length as radius.
    """
    radius = np.linalg.norm(vector, axis=1)
    r = np.minimum(thick, _MAX_RADIUS_TO_TURN_RADIUS * radius)
    head = np.divide(_HEAD_LENGTH_RATIO * r, radius, out=np.zeros_like(r), where=radius > 0)
    shaft = (_TURN_ANGLE - head)[:, None] * np.linspace(0.0, 1.0, _SHAFT_SECTIONS)
    neck = shaft[:, -1:]
    angles = np.concatenate([0 * neck, shaft, neck, 0 * neck + _TURN_ANGLE], axis=1)
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=2)
    parts = np.array([0.0, *np.ones(_SHAFT_SECTIONS), _HEAD_RADIUS_RATIO, 0.0])
    rings = _arrow_rings(
        radius[:, None, None] * outward, r[:, None] * parts, (0.0, 0.0, 1.0), outward
    )
    return _place_rings(rings, at, vector), _arrow_faces(len(parts))


def _arrow_faces(rings: int) -> Faces:
    return tube_faces(rings, _CORNERS_AROUND)


def _arrow_rings(
    centres: Array, radii: Array, first: Array | tuple[float, ...], second: Array
) -> Array:
    """Circles (f, p, around, 3) about centres (f, p, 3), normal to first x second."""
    angles = 2 * np.pi * np.arange(_CORNERS_AROUND) / _CORNERS_AROUND
    first_axes, second_axes = (
        np.broadcast_to(x, centres.shape)[:, :, None] for x in (first, second)
    )
    circle = np.cos(angles)[:, None] * first_axes + np.sin(angles)[:, None] * second_axes
    return np.asarray(centres[:, :, None] + radii[:, :, None, None] * circle)


def _place_rings(rings: Array, at: Array, vector: Array) -> Array:
    """Vertices (f, n, 3) with z along the vectors and the origin at the points."""
    length = np.linalg.norm(vector, axis=1)
    axes = [
        axes_along(v) if length_of_vector > 0 else np.eye(3)
        for v, length_of_vector in zip(vector, length, strict=True)
    ]
    local = rings.reshape(len(rings), -1, 3)
    return at[:, None] + np.einsum("fij,fnj->fni", np.array(axes), local)
