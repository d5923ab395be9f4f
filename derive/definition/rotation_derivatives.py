"""How functions of a rotation change as it goes on, and its rotation vector."""

from __future__ import annotations

import sympy as sp

from .derivation import axial, tilde
from .nonsmooth_functions import slope

#: Squared tangent of half the angle up to which the angle is taken from its series.
_NEAR = sp.Rational(1, 100)
_TERMS = 9


def turning_rate(value: sp.Basic, rotation: sp.Matrix, w: sp.Matrix) -> sp.Basic:
    """Rate of an expression or a matrix of the rotation R, which changes by R' = w~ R."""
    entries = [sp.Dummy(real=True) for _ in rotation]
    held, time = sp.Matrix(3, 3, entries), sp.Dummy(real=True)
    moved = held + time * (tilde(w) * held)
    later = value.xreplace(dict(zip(rotation, moved, strict=True)))
    found = slope(later, time).xreplace({time: sp.Integer(0)})
    return found.xreplace(dict(zip(entries, rotation, strict=True)))


def rotation_vector(rotation: sp.Matrix) -> sp.Matrix:
    """Angle times axis of a rotation by less than half a turn (3 x 1), rad.

    By tan(angle / 2) n = axial(R) / (1 + cos(angle)), with 1 + cos(angle) = (1 + trace) / 2.
    """
    tangent = 2 * axial(rotation) / (1 + rotation.trace())
    return sp.Matrix(tangent * _angle_by_tangent(tangent.dot(tangent)))


def _angle_by_tangent(square: sp.Expr) -> sp.Expr:
    """2 atan(t) / t for t^2, by the series near 0."""
    root = sp.sqrt(square)
    near = sp.Integer(0)
    for k in reversed(range(_TERMS)):
        near = near * square + 2 * sp.Rational((-1) ** k, 2 * k + 1)
    return sp.Piecewise((near, square < _NEAR), (2 * sp.atan(root) / root, True))
