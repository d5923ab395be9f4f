"""Rotations in definitions: unit quaternions, time derivatives, and the rotation vector.

Unit quaternions (w, x, y, z) are hinge coordinates, used normalised everywhere.
"""

from __future__ import annotations

import sympy as sp

from .derivation import axial, tilde
from .nonsmooth_functions import slope

#: Squared tangent of half the angle below which the angle is computed by its series.
_SERIES_LIMIT = sp.Rational(1, 100)
_TERMS = 9


def rotation_of(w: sp.Expr, x: sp.Expr, y: sp.Expr, z: sp.Expr) -> sp.Matrix:
    """Rotation matrix of the normalised quaternion; homogeneous of degree zero in (w, x, y, z)."""
    scale = 2 / (w**2 + x**2 + y**2 + z**2)
    return sp.Matrix(
        [
            [1 - scale * (y**2 + z**2), scale * (x * y - w * z), scale * (x * z + w * y)],
            [scale * (x * y + w * z), 1 - scale * (x**2 + z**2), scale * (y * z - w * x)],
            [scale * (x * z - w * y), scale * (y * z + w * x), 1 - scale * (x**2 + y**2)],
        ]
    )


def rate_of(quaternion: sp.Matrix, angular_velocity: sp.Matrix) -> sp.Matrix:
    """Quaternion rate from the angular velocity in the rotated (outboard) axes."""
    w, x, y, z = quaternion
    wx, wy, wz = angular_velocity
    return sp.Rational(1, 2) * sp.Matrix(
        [
            -x * wx - y * wy - z * wz,
            w * wx + y * wz - z * wy,
            w * wy + z * wx - x * wz,
            w * wz + x * wy - y * wx,
        ]
    )


def rotating_derivative(value: sp.Basic, rotation: sp.Matrix, w: sp.Matrix) -> sp.Basic:
    """Time derivative of an expression or matrix in the rotation R, with R' = w~ R."""
    entries = [sp.Dummy(real=True) for _ in rotation]
    matrix, time = sp.Matrix(3, 3, entries), sp.Dummy(real=True)
    rotated = matrix + time * (tilde(w) * matrix)
    shifted = value.xreplace(dict(zip(rotation, rotated, strict=True)))
    rate = slope(shifted, time).xreplace({time: sp.Integer(0)})
    return rate.xreplace(dict(zip(entries, rotation, strict=True)))


def rotation_vector(rotation: sp.Matrix) -> sp.Matrix:
    """Angle times axis (3 x 1, rad) of a rotation by less than half a turn.

    From tan(angle / 2) n = axial(R) / (1 + cos(angle)), with 1 + cos(angle) = (1 + trace) / 2.
    """
    tangent = 2 * axial(rotation) / (1 + rotation.trace())
    return sp.Matrix(tangent * _angle_by_tangent(tangent.dot(tangent)))


def _angle_by_tangent(square: sp.Expr) -> sp.Expr:
    """2 atan(t) / t as a function of t^2, by its series near 0."""
    root = sp.sqrt(square)
    near = sp.Integer(0)
    for k in reversed(range(_TERMS)):
        near = near * square + 2 * sp.Rational((-1) ** k, 2 * k + 1)
    return sp.Piecewise((near, square < _SERIES_LIMIT), (2 * sp.atan(root) / root, True))
