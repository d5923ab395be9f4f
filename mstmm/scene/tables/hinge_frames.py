"""Frames of a hinge in the axes of its ends, and the parameters of its kernel.

All results are exact where axes coincide, and differentiable (`numbers.dual`).
"""

from __future__ import annotations

import math

from ...numerics.dual import atan2
from ...numerics.rotations import (
    IDENTITY,
    Matrix,
    Vector,
    cross,
    dot,
    norm,
    perpendicular_vector,
    unit_rejection,
)
from .hinge import HingeTable


def hinge_frames(hinge: HingeTable) -> tuple[Matrix, Matrix]:
    """Inboard and outboard axes of the hinge kernel in the axes of the outboard end at q = 0."""
    frame = "axis" if hinge.facts is None else hinge.facts.frame
    if frame == "own":
        return IDENTITY, IDENTITY
    if frame == "crossing":
        x = _common_normal(hinge)
        return _axes_matrix(hinge.unit_axis, x), _axes_matrix(_second_axis(hinge), x)
    aligned = axes_about(hinge.unit_axis, hinge.unit_axis2 if frame == "plane" else None)
    return aligned, aligned


def twist_axes(hinge: HingeTable) -> Matrix:
    """Axes in which a law decomposes a rotation: twist about z, the axis of the hinge."""
    return axes_about(hinge.unit_axis, None)


def parameters_from_keys(hinge: HingeTable) -> dict[str, float]:
    """Kernel parameters by name that follow from keys of the hinge, such as lead or axis angle."""
    facts = hinge.facts
    if facts is None:
        return {}
    parameter_values = {
        p.name: getattr(hinge, p.name) for p in facts.parameters if p.name in facts.keys
    }
    if facts.frame == "crossing":
        second_axis = _second_axis(hinge)
        sine = norm(cross(hinge.unit_axis, second_axis))
        parameter_values[facts.parameters[0].name] = atan2(sine, dot(hinge.unit_axis, second_axis))
    return parameter_values


def initial_motion_axes(hinge: HingeTable) -> list[tuple[Vector, Vector]] | None:
    """Translation and rotation of the outboard end per unit of each speed, in its own axes.

    The coordinates have their default initial values.  None where the type is not defined, or its
    motion is not finite there.
    """
    facts = hinge.facts
    if facts is None:
        return None
    given_values = {**hinge.parameters, **parameters_from_keys(hinge)}
    numbers = [float(given_values.get(p.name, p.default or 0.0)) for p in facts.parameters]
    motions, (_, outboard) = facts.start_motion_columns(numbers), hinge_frames(hinge)
    if not all(math.isfinite(x) for pair in motions for vector in pair for x in vector):
        return None
    return [(_rotate(outboard, t), _rotate(outboard, r)) for t, r in motions]


def _rotate(axes: Matrix, v: Vector) -> Vector:
    x, y, z = (sum(a * b for a, b in zip(row, v, strict=True)) for row in axes)
    return (x, y, z)


def axes_about(axis: Vector, in_plane: Vector | None) -> Matrix:
    """Rotation matrix with z along a unit vector, and x along `in_plane` or arbitrary."""
    if in_plane is not None:
        return _axes_matrix(axis, unit_rejection(in_plane, axis))
    return IDENTITY if axis == (0.0, 0.0, 1.0) else _axes_matrix(axis, perpendicular_vector(axis))


def _axes_matrix(z: Vector, x: Vector) -> Matrix:
    """Rotation matrix with columns x, z x x, z."""
    y = cross(z, x)
    return ((x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2]))


def _common_normal(hinge: HingeTable) -> Vector:
    normal = cross(hinge.unit_axis, _second_axis(hinge))
    length = norm(normal)
    return (normal[0] / length, normal[1] / length, normal[2] / length)


def _second_axis(hinge: HingeTable) -> Vector:
    second_axis = hinge.unit_axis2
    assert second_axis is not None
    return second_axis
