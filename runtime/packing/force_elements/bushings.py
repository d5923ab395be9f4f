"""Numbers of bushings, with end axes that coincide in the unloaded pose."""

from __future__ import annotations

from mstmm.numerics.rotations import Matrix, Vector, product, rotate, to_matrix, transpose
from mstmm.scene import Bushing

from ..scene_frames import Frames
from ..system import ForceNumbers, Numbers


def bushing_numbers(frames: Frames, bushing: Bushing) -> ForceNumbers:
    """Force element between the unloaded pose, fixed to the body of `from`, and the end `to`."""
    body, axes, position = _end(frames, bushing, bushing.from_)
    bushing_axes = product(axes, bushing.rotation)
    rest = _sum(position, rotate(bushing_axes, bushing.rest.position))
    to_body, to_axes, to_position = _end(frames, bushing, bushing.to)
    to_axes = product(to_axes, transpose(bushing.rest.rotation))
    ends = (
        (body, _row_major_entries(bushing_axes), rest),
        (to_body, _row_major_entries(to_axes), to_position),
    )
    return ForceNumbers(("force", bushing.element), ends, bushing.numbers, None)


def _end(frames: Frames, bushing: Bushing, reference: str) -> tuple[int, Matrix, Vector]:
    """Position in the tree, axes and offset (m) of an end."""
    body, (a, b, c, d, e, f, g, h, i), offset = frames.end(reference)
    x, y, z = bushing.position if body < 0 else offset
    return body, to_matrix([[a, b, c], [d, e, f], [g, h, i]]), (x, y, z)


def _sum(a: Vector, b: Vector) -> Vector:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _row_major_entries(matrix: Matrix) -> Numbers:
    return (*matrix[0], *matrix[1], *matrix[2])
