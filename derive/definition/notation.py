"""Notation of premises: unevaluated cross products, explicit form, linear solution.

Premises are kept in matrix symbols so that they can be displayed; `explicit` expands them entry by
entry, and `solve_linear` solves them for the matrices that the definitions state.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement
from sympy.solvers.solveset import NonlinearError

from .derivation import Equation, axial, tilde
from .nonsmooth_functions import slope

#: Explicit matrix type of derivations.
Matrix: TypeAlias = sp.ImmutableDenseMatrix


class Tilde(sp.MatrixExpr):
    """Cross-product matrix of a 3 x 1 matrix expression, kept unevaluated: Tilde(a) b = a x b."""

    def __new__(cls, vector: sp.Basic) -> Tilde:
        if tuple(vector.shape) != (3, 1):
            raise ValueError(f"cross-product matrix: expected a 3 x 1 column, found {vector.shape}")
        instance: Tilde = super().__new__(cls, vector)
        return instance

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (sp.Integer(3), sp.Integer(3))

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return explicit(self)[i, j]


class Perp(sp.MatrixExpr):
    """Plane vector rotated by +90 degrees: b . Perp(a) is the plane cross product a x b."""

    def __new__(cls, vector: sp.Basic) -> Perp:
        if tuple(vector.shape) != (2, 1):
            raise ValueError(f"plane vector: expected a 2 x 1 column, found {vector.shape}")
        instance: Perp = super().__new__(cls, vector)
        return instance

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (sp.Integer(2), sp.Integer(1))

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return explicit(self)[i, j]


def explicit(expression: sp.Basic) -> Matrix:
    """Entries of a matrix expression of matrix symbols, cross products and explicit matrices."""
    if isinstance(expression, sp.MatAdd):
        first, *rest = (explicit(term) for term in expression.args)
        return Matrix(sum(rest, first))
    if isinstance(expression, sp.MatMul):
        factor, (first, *factors) = expression.as_coeff_matrices()
        product = explicit(first)
        for operand in factors:
            product = product * explicit(operand)
        return Matrix(factor * product)
    if isinstance(expression, sp.Transpose):
        return Matrix(explicit(expression.arg).T)
    if isinstance(expression, sp.MatPow):
        return Matrix(explicit(expression.base) ** int(expression.exp))
    if isinstance(expression, Tilde):
        return tilde(explicit(expression.args[0]))
    if isinstance(expression, Perp):
        x, y = explicit(expression.args[0])
        return Matrix([-y, x])
    return Matrix(expression.as_explicit())


def residual(equation: Equation) -> Matrix:
    """left - right as a matrix of entries (scalars as 1 x 1)."""
    return Matrix(explicit(equation.left) - explicit(equation.right))


def solve_linear(
    premises: Sequence[Equation],
    unknowns: Sequence[sp.MatrixSymbol],
    knowns: Sequence[sp.MatrixSymbol],
) -> Matrix:
    """The matrix W with unknowns = W [knowns; 1], from premises linear in both.

    Raises ValueError if a premise is not linear in them, or if the premises do not determine every
    unknown.
    """
    entries = [entry for symbol in (*unknowns, *knowns) for entry in explicit(symbol)]
    names = {entry: sp.Dummy(str(entry)) for entry in entries}
    residuals = [entry for premise in premises for entry in residual(premise).xreplace(names)]
    unknown_names = [names[e] for symbol in unknowns for e in explicit(symbol)]
    known_names = [names[e] for symbol in knowns for e in explicit(symbol)]
    try:
        coefficients, right = sp.linear_eq_to_matrix(residuals, [*unknown_names, *known_names])
    except NonlinearError as error:
        raise ValueError(f"a premise is not linear in the state: {error}") from error
    matrix = coefficients[:, : len(unknown_names)]
    right_side = coefficients[:, len(unknown_names) :].row_join(-right)
    if matrix.rows != matrix.cols or matrix.applyfunc(sp.expand).rank() < matrix.cols:
        raise ValueError("the premises do not determine every unknown")
    return Matrix(-matrix.LUsolve(right_side)).applyfunc(sp.expand)


def matrix_symbols(expression: sp.Basic) -> set[sp.MatrixSymbol]:
    """Matrix symbols that an expression depends on, also through their entries."""
    return {
        *expression.atoms(sp.MatrixSymbol),
        *(e.parent for e in expression.atoms(MatrixElement)),
    }


# --- blocks of small matrices ---------------------------------------------------------------------


def symbol(name: str, rows: int, columns: int = 1) -> sp.MatrixSymbol:
    """Matrix symbol; a column by default."""
    return sp.MatrixSymbol(name, rows, columns)


def part(array: sp.MatrixSymbol, first: int, count: int = 3) -> sp.ImmutableDenseMatrix:
    """Rows first .. first + count of a column."""
    return sp.ImmutableDenseMatrix([array[i, 0] for i in range(first, first + count)])


def column(array: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """Column as an explicit matrix of entries."""
    return part(array, 0, int(array.rows))


def stack(*parts: sp.Basic) -> sp.BlockMatrix:
    """Block column with the parts on top of each other."""
    return sp.BlockMatrix([[single] for single in parts])


def diagonal(matrix: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """Diagonal of a square matrix as a column."""
    return sp.ImmutableDenseMatrix([matrix[i, i] for i in range(int(matrix.rows))])


# --- rotations ------------------------------------------------------------------------------------
# Unit quaternions (w, x, y, z) are hinge coordinates, used normalised everywhere.

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
