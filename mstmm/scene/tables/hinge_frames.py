"""Frames of a hinge in the axes of its ends, and the parameters of its kernel.

All results are exact where axes coincide, and differentiable (`numbers.dual`).
"""

from __future__ import annotations

import math

from ...numbers.dual import atan2
from ...numbers.rotations import (
    IDENTITY,
    Matrix,
    Vector,
    cross,
    dot,
    norm,
    perpendicular,
    reject,
)
from .hinge_keys import HingeKeys


def hinge_frames(hinge: HingeKeys) -> tuple[Matrix, Matrix]:
    """Inboard and outboard axes of the hinge kernel in the axes of the outboard end at q = 0."""
    frame = "axis" if hinge.facts is None else hinge.facts.frame
    if frame == "own":
        return IDENTITY, IDENTITY
    if frame == "crossing":
        x = _common_normal(hinge)
        return _frame(hinge.unit_axis, x), _frame(_second(hinge), x)
    aligned = about(hinge.unit_axis, hinge.unit_axis2 if frame == "plane" else None)
    return aligned, aligned


def twist_axes(hinge: HingeKeys) -> Matrix:
    """Axes in which a law decomposes a rotation: twist about z, the axis of the hinge."""
    return about(hinge.unit_axis, None)


def key_numbers(hinge: HingeKeys) -> dict[str, float]:
    """Kernel parameters by name that follow from keys of the hinge, such as lead or axis angle."""
    facts = hinge.facts
    if facts is None:
        return {}
    found = {p.name: getattr(hinge, p.name) for p in facts.parameters if p.name in facts.keys}
    if facts.frame == "crossing":
        second = _second(hinge)
        size = norm(cross(hinge.unit_axis, second))
        found[facts.parameters[0].name] = atan2(size, dot(hinge.unit_axis, second))
    return found


def start_motion(hinge: HingeKeys) -> list[tuple[Vector, Vector]] | None:
    """Translation and rotation of the outboard end per unit of each speed, in its own axes.

    The coordinates have their default initial values.  None where the type is not defined, or its
    motion is not finite there.
    """
    facts = hinge.facts
    if facts is None:
        return None
    given = {**hinge.parameters, **key_numbers(hinge)}
    numbers = [float(given.get(p.name, p.default or 0.0)) for p in facts.parameters]
    motions, (_, outboard) = facts.at_start(numbers), hinge_frames(hinge)
    if not all(math.isfinite(x) for pair in motions for vector in pair for x in vector):
        return None
    return [(_turned(outboard, t), _turned(outboard, r)) for t, r in motions]


def _turned(axes: Matrix, v: Vector) -> Vector:
    x, y, z = (sum(a * b for a, b in zip(row, v, strict=True)) for row in axes)
    return (x, y, z)


def about(axis: Vector, in_plane: Vector | None) -> Matrix:
    """Rotation matrix with z along a unit vector, and x along `in_plane` or arbitrary."""
    if in_plane is not None:
        return _frame(axis, reject(in_plane, axis))
    return IDENTITY if axis == (0.0, 0.0, 1.0) else _frame(axis, perpendicular(axis))


def _frame(z: Vector, x: Vector) -> Matrix:
    """Rotation matrix with columns x, z x x, z."""
    y = cross(z, x)
    return ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))


def _common_normal(hinge: HingeKeys) -> Vector:
    normal = cross(hinge.unit_axis, _second(hinge))
    size = norm(normal)
    return (normal[0] / size, normal[1] / size, normal[2] / size)


def _second(hinge: HingeKeys) -> Vector:
    second = hinge.unit_axis2
    assert second is not None
    return second
