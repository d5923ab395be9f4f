"""Unit quaternions (w, x, y, z) as hinge coordinates, used normalised everywhere."""

from __future__ import annotations

import sympy as sp


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
