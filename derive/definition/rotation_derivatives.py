"""Time derivative of functions of a rotation, and the rotation vector."""

from __future__ import annotations

import sympy as sp

from .derivation import axial, tilde
from .nonsmooth_functions import slope

#: Squared tangent of half the angle below which the angle is computed by its series.
_SERIES_LIMIT = sp.Rational(1, 100)
_TERMS = 9


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
