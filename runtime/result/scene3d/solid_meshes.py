"""Triangle meshes of bodies, hinges and the ground in the axes of their owner, and of arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array

#: Corners around round solids.
CORNERS_AROUND = 20

Colour = tuple[int, int, int]
Faces = NDArray[np.int64]


@dataclass(frozen=True)
class Surface:
    """Triangle mesh: vertices (n, 3) in m, faces (m, 3) by vertex index.

    Faces are anticlockwise as seen from outside.
    """

    vertices: Array
    faces: Faces

    def with_scale(self, factor: float) -> Surface:
        """Surface scaled about the origin of its axes."""
        return replace(self, vertices=factor * self.vertices)

    def with_pose(self, at: ArrayLike = (0.0, 0.0, 0.0), axes: ArrayLike | None = None) -> Surface:
        """Surface rotated by `axes` (3, 3) and moved by `at` (3,)."""
        rotated = self.vertices if axes is None else self.vertices @ np.asarray(axes).T
        return replace(self, vertices=rotated + np.asarray(at))


def join_surfaces(parts: Sequence[Surface]) -> Surface:
    """All parts as one surface."""
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return Surface(vertices, np.concatenate(faces))


def box_surface(size: ArrayLike) -> Surface:
    """Box about the origin with these three edge lengths."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    vertices = corners[[k for quad in quads for k in quad]]  # faces share none: sharp edges
    first = 4 * np.arange(6)[:, None]
    faces = np.concatenate([first + np.array(corner) for corner in ((0, 1, 2), (0, 2, 3))])
    return Surface(vertices * np.asarray(size, dtype=np.float64), faces)


def revolved_surface(profile: ArrayLike, around: int = CORNERS_AROUND) -> Surface:
    """Surface of revolution of a line of (radius, z) about z, from the bottom to the top.

    Ends that are off the axis are closed by discs.
    """
    line = [(float(r), float(z)) for r, z in np.asarray(profile)]
    if line[0][0] > 0:  # separate vertices on the rim keep it sharp
        line[:0] = [(0.0, line[0][1]), line[0]]
    if line[-1][0] > 0:
        line += [line[-1], (0.0, line[-1][1])]
    angles = 2 * np.pi * np.arange(around) / around
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = [np.column_stack([r * circle, np.full(around, z)]) for r, z in line]
    return Surface(np.concatenate(rings), tube_faces(len(line), around))


def tube_faces(rings: int, around: int) -> Faces:
    """Faces between rings of vertices, each ring anticlockwise about the forward direction."""
    k, j = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a, b = k * around + j, k * around + (j + 1) % around
    c, d = a + around, b + around
    quads = np.stack([a, b, d, c], axis=-1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def cylinder_surface(radius: float, length: float, around: int = CORNERS_AROUND) -> Surface:
    """Cylinder about z, centred at the origin."""
    return revolved_surface([(radius, -length / 2), (radius, length / 2)], around)


def capsule_surface(radius: float, length: float, around: int = CORNERS_AROUND) -> Surface:
    """Cylinder of this length about z with a hemisphere on each end."""
    angles = np.linspace(0.0, np.pi / 2, around // 4 + 1)
    cap = np.stack([radius * np.cos(angles), radius * np.sin(angles) + length / 2], axis=1)
    return revolved_surface(np.concatenate([cap[::-1] * (1, -1), cap]), around)


def ellipsoid_surface(axes: ArrayLike, around: int = CORNERS_AROUND) -> Surface:
    """Ellipsoid about the origin with these three semi-axes."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1)
    ball = revolved_surface(np.stack([np.cos(angles), np.sin(angles)], axis=1), around)
    return replace(ball, vertices=ball.vertices * np.asarray(axes, dtype=np.float64))


def bar_surface(start: ArrayLike, end: ArrayLike, radius: float, around: int = 10) -> Surface:
    """Round bar from one point to another."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    return cylinder_surface(radius, float(np.linalg.norm(b - a)), around).with_pose(
        (a + b) / 2, axes_along(b - a)
    )


def axes_along(direction: ArrayLike) -> Array:
    """Rotation (3, 3) of z to a direction."""
    z = np.asarray(direction, dtype=np.float64)
    z = z / np.linalg.norm(z)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


# --- arrows with a length proportional to a vector ------------------------------------------------

#: Corners around the shaft; radius and length of the head, relative to the radius of the shaft.
_ARROW_CORNERS, _HEAD_RADIUS_RATIO, _HEAD_LENGTH_RATIO = 10, 2.4, 6.0
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
    return tube_faces(rings, _ARROW_CORNERS)


def _arrow_rings(
    centres: Array, radii: Array, first: Array | tuple[float, ...], second: Array
) -> Array:
    """Circles (f, p, around, 3) about centres (f, p, 3), normal to first x second."""
    angles = 2 * np.pi * np.arange(_ARROW_CORNERS) / _ARROW_CORNERS
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
