"""The formulas of Jing and Stephansson, chapter 2, as printed, spelled out for comparison only.

Nothing is derived from these; `formulas` compares them with the derived forms.
"""

from __future__ import annotations

import sympy as sp

from mstmm.derive.definition.notation import Matrix
from mstmm.derive.equations.newton_euler import (
    A0,
    OMEGA,
    OMEGADOT,
    POINT,
    MassDistribution,
    general,
)

#: Position of the moving origin (X', Y', Z') and its second derivatives, inertial axes.
ORIGIN = Matrix(sp.symbols("X_o Y_o Z_o", real=True))
ORIGIN_DD = Matrix(sp.symbols("Xdd_o Ydd_o Zdd_o", real=True))
#: Second derivatives of the coordinates x, y, z in parallel axes.
LOCAL_DD = Matrix(sp.symbols("xdd ydd zdd", real=True))


def moment(a: Matrix, r: Matrix) -> Matrix:
    """The bracket (a_z y - a_y z, a_x z - a_z x, a_y x - a_x y) of (2.20)."""
    (ax, ay, az), (x, y, z) = a, r
    return Matrix([az * y - ay * z, ax * z - az * x, ay * x - ax * y])


def acceleration_field(last_rate: sp.Expr) -> Matrix:
    """(2.18), with the rate that is printed last in the y component as argument."""
    x, y, z = POINT
    wx, wy, wz = OMEGA
    dx, dy, dz = OMEGADOT
    return Matrix(
        [
            A0[0] - x * (wy**2 + wz**2) + y * (wx * wy - dz) + z * (wx * wz + dy),
            A0[1] + x * (wx * wy + dz) - y * (wx**2 + wz**2) + z * (wy * wz - last_rate),
            A0[2] + x * (wx * wz - dy) + y * (wy * wz + dx) - z * (wx**2 + wy**2),
        ]
    )


def inertia_array(body: MassDistribution) -> Matrix:
    """(2.10), with positive off-diagonal entries."""
    (xx, yy, zz), (xy, xz, yz) = body.moments, body.products
    return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def characteristic_array(body: MassDistribution, root: sp.Expr) -> Matrix:
    """The array whose determinant vanishes in (2.12)."""
    (xx, yy, zz), (xy, xz, yz) = body.moments, body.products
    return Matrix([[root - xx, xy, xz], [xy, root - yy, yz], [xz, yz, root - zz]])


def euler_reduced() -> Matrix:
    """Left side of (2.25)."""
    body = general()
    (ixx, iyy, izz), (ixy, ixz, iyz) = body.moments, body.products
    wx, wy, wz = OMEGA
    dx, dy, dz = OMEGADOT
    return Matrix(
        [
            ixx * dx + (izz - iyy) * wy * wz
            + ixy * (wx * wz - dy) - ixz * (wx * wy + dz) + iyz * (wz**2 - wy**2),
            iyy * dy + (ixx - izz) * wx * wz
            + iyz * (wy * wx - dz) - ixy * (wy * wz + dx) + ixz * (wx**2 - wz**2),
            izz * dz + (iyy - ixx) * wx * wy
            + ixz * (wy * wz - dx) - iyz * (wx * wz + dy) + ixy * (wy**2 - wx**2),
        ]
    )  # fmt: skip


def euler_general() -> Matrix:
    """Left side of (2.22)."""
    body = general()
    return Matrix(body.mass * moment(A0, body.center) + euler_reduced())


def euler_reduced_principal() -> Matrix:
    """Left side of (2.26)."""
    ixx, iyy, izz = general().moments
    wx, wy, wz = OMEGA
    dx, dy, dz = OMEGADOT
    return Matrix(
        [
            ixx * dx + (izz - iyy) * wy * wz,
            iyy * dy + (ixx - izz) * wx * wz,
            izz * dz + (iyy - ixx) * wx * wy,
        ]
    )


def euler_principal() -> Matrix:
    """Left side of (2.24)."""
    body = general()
    return Matrix(body.mass * moment(A0, body.center) + euler_reduced_principal())


def split_moment(second_line: sp.Expr) -> Matrix:
    """Integrand of (2.31); `second_line` stands where the second line prints z'."""
    x, y, z = POINT
    whole = Matrix(ORIGIN_DD + LOCAL_DD)
    middle = Matrix(
        [
            LOCAL_DD[2] * y - LOCAL_DD[1] * z,
            LOCAL_DD[0] * second_line - LOCAL_DD[2] * x,
            LOCAL_DD[1] * x - LOCAL_DD[0] * y,
        ]
    )
    return Matrix(moment(whole, ORIGIN) + middle + moment(ORIGIN_DD, POINT))
