"""Bushings: their ends turned so that the axes of both coincide at rest."""

from __future__ import annotations

from mstmm.numerics.rotations import Matrix, Vector, product, rotate, to_matrix, transpose
from mstmm.scene import Bushing

from ..scene_frames import Frames
from ..system import ForceNumbers, Numbers


def bushing_numbers(frames: Frames, bushing: Bushing) -> ForceNumbers:
    """The force element between the place of rest, which `from` carries, and the end `to`."""
    body, axes, place = _end(frames, bushing, bushing.from_)
    turned = product(axes, bushing.rotation)
    rest = _sum(place, rotate(turned, bushing.rest.position))
    other, own, end = _end(frames, bushing, bushing.to)
    alike = product(own, transpose(bushing.rest.rotation))
    ends = ((body, _flat(turned), rest), (other, _flat(alike), end))
    return ForceNumbers(("force", bushing.element), ends, bushing.numbers, None)


def _end(frames: Frames, bushing: Bushing, reference: str) -> tuple[int, Matrix, Vector]:
    body, (a, b, c, d, e, f, g, h, i), offset = frames.end(reference)
    x, y, z = bushing.position if body < 0 else offset
    return body, to_matrix([[a, b, c], [d, e, f], [g, h, i]]), (x, y, z)


def _sum(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _flat(matrix: Matrix) -> Numbers:
    return (*matrix[0], *matrix[1], *matrix[2])
