"""Arrays of a flexible body shared by its kernels; n modes, known at run time.

The displacement of a material point r0 is u = phi eta - 1/2 eta^T g eta (g: second order, such as
foreshortening by bending, or deflection by bending and twist).  All inertia integrals are moments
of the fields [1, r0, phi, g] under the mass density rho:

    m, c0 = int r0, R2_ab = int r0_a r0_b            C_a = int phi_a,     E_ab = int r0_a phi_b
    F_ab = int phi_a phi_b^T,  M = sum_a F_aa        G_a = int g_a,       X_ab = int r0_a g_b

    B_ab = E_ab + E_ba              Z_ab = F_ab + F_ab^T - X_ab - X_ba    (ab = xx xy xz yy yz zz)
    P_i = eps_iab E_ab              Y_i = eps_iab (F_ab - X_ab)
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Quantity

#: Number of modes.
N = sp.Symbol("n", integer=True, positive=True)

AXES = ("x", "y", "z")
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")

SOURCES = (
    "Shabana, Dynamics of Multibody Systems, ch. 5 (floating frame of reference)",
    "Schwertassek, Wallrapp, Dynamik flexibler Mehrkoerpersysteme (invariants, unit loads)",
    "Rui, Wang, Zhang, ch. 8 (rigid-flexible systems)",
)


def modal_columns(name: str, rows: int, meaning: str = "", unit: str = "") -> Quantity:
    """Array with a column per mode."""
    return Quantity(sp.MatrixSymbol(name, rows, N), unit, meaning)


def modal_pair(name: str, meaning: str = "", unit: str = "", accumulate: bool = False) -> Quantity:
    """Array with a row and a column per mode."""
    return Quantity(sp.MatrixSymbol(name, N, N), unit, meaning, accumulate=accumulate)


def modal_vector(
    name: str, meaning: str = "", unit: str = "", accumulate: bool = False
) -> Quantity:
    """One number per mode."""
    return Quantity(sp.MatrixSymbol(name, N, 1), unit, meaning, accumulate=accumulate)


RIGID = Quantity(
    sp.MatrixSymbol("p", 10, 1), "", "m, c0 (3), R2 (xx xy xz yy yz zz); frame axes, about o"
)
C = modal_columns("C", 3, "int rho phi")
P = modal_columns("P", 3, "int rho r0 x phi")
B = modal_columns("B", 6, "first derivatives of the second moments: E_ab + E_ba")
Z = tuple(modal_pair(f"Z_{ab}", f"second derivative of the second moment {ab}") for ab in PAIRS)
Y = tuple(modal_pair(f"Y_{i}", f"(int rho phi x phi - r0 x g)_{i}") for i in AXES)
G = tuple(modal_pair(f"G_{a}", f"int rho g_{a}") for a in AXES)
MASS = modal_pair("M", "int rho phi . phi")
STIFFNESS = modal_pair("K", "stiffness")
DAMPING = modal_pair("D", "damping")
ETA = modal_vector("eta", "modal coordinates")
ETAD = modal_vector("etad", "modal speeds")

#: Moments of one density: data of the kernels `residual` and `momentum`.
MOMENTS = (RIGID, C, P, B, *Z, *Y, *G, MASS)


def row_entries(array: sp.Basic, first: int, count: int = 3) -> sp.ImmutableDenseMatrix:
    """Rows first .. first + count of a column, entry by entry."""
    return sp.ImmutableDenseMatrix([array[i, 0] for i in range(first, first + count)])


def stack_rows(*rows: sp.Basic) -> sp.BlockMatrix:
    """Stacked matrices."""
    return sp.BlockMatrix([[row] for row in rows])


def symmetric_matrix(symmetric: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Symmetric 3 x 3 matrix from a column xx xy xz yy yz zz."""
    xx, xy, xz, yy, yz, zz = (symmetric[i, 0] for i in range(6))
    return sp.ImmutableDenseMatrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_of_second_moments(second: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Moments of inertia tr(R) 1 - R of second moments R (6, in a column)."""
    second_moment_matrix = symmetric_matrix(second)
    return sp.ImmutableDenseMatrix(
        (second_moment_matrix[0, 0] + second_moment_matrix[1, 1] + second_moment_matrix[2, 2])
        * sp.eye(3)
        - second_moment_matrix
    )
