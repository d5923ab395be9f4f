"""Arrows whose length goes with what they stand for: straight ones of forces, turned ones of
moments."""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array

from .solids import Faces, along, tube_faces

#: Corners once around; a head is so many times as thick and as long as its shaft is thick.
_AROUND, _WIDE, _LONG = 10, 2.4, 6.0
#: Shafts of short arrows are thinner: at most this part of the length, or of a turn's radius.
_THIN, _FINE = 0.1, 0.22
#: Angle of a turned arrow, and sections of its shaft.
_TURN, _SECTIONS = 1.5 * np.pi, 16


def straight(at: Array, vector: Array, thick: float) -> tuple[Array, Faces]:
    """Vertices (f, n, 3) and faces of arrows from points (f, 3) along vectors (f, 3), in m; `thick`
    (m) is the radius of a shaft."""
    length = np.linalg.norm(vector, axis=1)
    r = np.minimum(thick, _THIN * length)
    neck = length - _LONG * r
    z = np.stack([0 * length, 0 * length, neck, neck, length], axis=1)
    centres = z[:, :, None] * np.array([0.0, 0.0, 1.0])
    radii = r[:, None] * np.array([0.0, 1.0, 1.0, _WIDE, 0.0])
    first, second = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    return _placed(_rings(centres, radii, first, second), at, vector), _faces(5)


def turned(at: Array, vector: Array, thick: float) -> tuple[Array, Faces]:
    """The same about points (f, 3): each arrow turns about its vector (f, 3), right-handed, at the
    vector's length from the point."""
    radius = np.linalg.norm(vector, axis=1)
    r = np.minimum(thick, _FINE * radius)
    head = np.divide(_LONG * r, radius, out=np.zeros_like(r), where=radius > 0)
    shaft = (_TURN - head)[:, None] * np.linspace(0.0, 1.0, _SECTIONS)
    neck = shaft[:, -1:]
    angles = np.concatenate([0 * neck, shaft, neck, 0 * neck + _TURN], axis=1)
    outward = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=2)
    parts = np.array([0.0, *np.ones(_SECTIONS), _WIDE, 0.0])
    rings = _rings(radius[:, None, None] * outward, r[:, None] * parts, (0.0, 0.0, 1.0), outward)
    return _placed(rings, at, vector), _faces(len(parts))


def _faces(rings: int) -> Faces:
    return tube_faces(rings, _AROUND)


def _rings(centres: Array, radii: Array, first: Array | tuple[float, ...], second: Array) -> Array:
    """(f, p, around, 3): circles about centres (f, p, 3) across first x second."""
    angles = 2 * np.pi * np.arange(_AROUND) / _AROUND
    one, other = (np.broadcast_to(x, centres.shape)[:, :, None] for x in (first, second))
    circle = np.cos(angles)[:, None] * one + np.sin(angles)[:, None] * other
    return np.asarray(centres[:, :, None] + radii[:, :, None, None] * circle)


def _placed(rings: Array, at: Array, vector: Array) -> Array:
    """(f, n, 3): z along the vectors, the origin at the points."""
    length = np.linalg.norm(vector, axis=1)
    axes = [along(v) if long > 0 else np.eye(3) for v, long in zip(vector, length, strict=True)]
    local = rings.reshape(len(rings), -1, 3)
    return at[:, None] + np.einsum("fij,fnj->fni", np.array(axes), local)
