"""Least-squares sweep: S = U^T U, carried from tips to root by rotations of rows.

Apart from efforts, the accelerations minimise the sum of the squares of rows (Gauss, J. reine
angew. Math. 4 (1829) 232-235).  A body's rows are a factor of its mass matrix, and the bodies
outboard of a body have rows as well:

    f = U^T (U a + d) + e,   S = U^T U

with U upper triangular, d the load in the range of the rows (all of it where U is regular, as for a
body with inertia of its own), and e the rest.  Across a hinge a = a_Q + H udot, and rotations
transform the rows, with those of rotors below them, to

    [U H       U  d]       [R_u  R_a  d_u]
    [sqrt(J)   0  0]  ->   [0    V    d_V]

so that D = R_u^T R_u, G = R_u^-1 R_a, and V, d_V are carried on: S_Q = V^T V, without the
difference S - U G of the Riccati sweep, in which the inertia of light links remains after
subtracting that of a heavy tip (Golub, Van Loan, Matrix Computations, 5.3, on rows against normal
equations).
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Triangle, Triangular, tilde
from ..definition.notation import column, part, stack, symbol
from .riccati_sweep import (
    FLOOR,
    MOTION,
    PARENT_E,
    SHIFT,
    SOURCES,
    E,
    R,
    S,
    free_speeds,
    gains,
    pivot_guards,
    transport,
)

#: Least ratio of a pivot of a mass matrix to its diagonal entry; smaller values are rounding.
_ROUNDING = sp.Rational(1, 10**15)
#: Rows with a diagonal entry above this share of their column carry load.
_MIN_ROW_SHARE = sp.Rational(1, 10**13)
#: Least remaining share, squared, of a column of U H after the columns before it.
_INDEPENDENT = sp.Rational(1, 10**26)

SOURCES_QR = (
    *SOURCES,
    "Gauss, J. reine angew. Math. 4 (1829) 232-235 (least constraint)",
    "Golub, Van Loan, Matrix Computations, 4th ed., 5.1-5.3 (rotations, least squares)",
)

ROWS = Quantity(symbol("U", 21), "", "upper triangle, row by row: S = U^T U")
ROW_LOAD = Quantity(symbol("d", 6), "", "load in the rows: f = U^T (U a + d) + e")
CARRIED_ROWS = Quantity(symbol("V", 21), "", "upper triangle outboard of the hinge")
CARRIED_ROW_LOAD = Quantity(symbol("d_V", 6), "", "load in its rows")
REMAINING_LOAD = Quantity(symbol("e_Q", 6), "N, N*m", "load outside the rows")

PARENT_ROWS = Quantity(symbol("U_P", 21), "", "upper triangle of the parent so far")
PARENT_ROW_LOAD = Quantity(symbol("d_P", 6), "", "load in its rows")


def triangular(entries: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """Upper triangular matrix from its 21 entries, row by row."""
    return sp.ImmutableDenseMatrix(
        6, 6, lambda i, j: entries[6 * i - i * (i + 1) // 2 + j, 0] if j >= i else sp.Integer(0)
    )


def _triangle_entries(matrix: sp.Basic) -> sp.ImmutableDenseMatrix:
    """Upper triangle of a 6 x 6 matrix as a column of 21 entries."""
    return sp.ImmutableDenseMatrix([matrix[i, j] for i in range(6) for j in range(i, 6)])


def _scalar_equation(name: str, value: sp.Expr, meaning: str) -> tuple[sp.Expr, Equation]:
    scalar = symbol(name, 1, 1)
    return scalar[0, 0], Equation(meaning, scalar, sp.ImmutableDenseMatrix([[value]]))


def factor() -> Derivation:
    """U of a single body: S = U^T U (Cholesky), for a mass matrix that may be singular."""
    equations: list[Equation] = []
    entries: list[list[sp.Expr]] = []
    for i in range(6):
        remainder = S.symbol[i, i] - sum(row[i] ** 2 for row in entries)
        least = _ROUNDING * S.symbol[i, i]
        root, root_equation = _scalar_equation(
            f"root_{i + 1}", sp.sqrt(sp.Max(remainder, least)), f"U_{i + 1}{i + 1}"
        )
        share, shared = _scalar_equation(
            f"share_{i + 1}", sp.Piecewise((1 / root, root > 0), (0, True)), f"1 / U_{i + 1}{i + 1}"
        )
        later = [
            (S.symbol[i, j] - sum(row[i] * row[j] for row in entries)) * share
            for j in range(i + 1, 6)
        ]
        row = symbol(f"row_{i + 1}", 1, 6)
        values = [*[sp.Integer(0)] * i, root, *later]
        equations += [
            root_equation, shared, Equation(f"row {i + 1}", row, sp.ImmutableDenseMatrix([values]))
        ]  # fmt: skip
        entries.append([row[0, j] for j in range(6)])
    matrix = sp.ImmutableDenseMatrix(entries)
    equations.append(Equation("U", ROWS.symbol, _triangle_entries(matrix)))
    return Derivation(
        "qr", "rows of a single body", (S,), (ROWS,), tuple(equations), sources=SOURCES_QR
    )


def bias() -> Derivation:
    """d and e of a single rigid body, from its rows instead of its load.

    Its load e_B = S [rdd + w x (w x r_C); wd] + [0; w x J_C w] loses digits by cancellation for
    a long arm r_C if the inertia J_C about the mass centre matters; its rows are sqrt(m) times
    the acceleration of the centre, and U_a times the angular one, J_C = U_a^T U_a.
    """
    u, motion = triangular(ROWS.symbol), MOTION.symbol
    w, wd, rdd = (part(motion, k) for k in (0, 3, 6))
    arm = sp.ImmutableDenseMatrix([u[1, 5], -u[0, 5], u[0, 4]])
    inner = sp.ImmutableDenseMatrix(3, 3, lambda i, j: u[3 + i, 3 + j])
    accelerations, turning = symbol("a_B", 6), symbol("b", 6)
    inertia_rows, spun = symbol("U_a", 3, 3), symbol("h", 3)
    spin = tilde(w)
    return Derivation(
        "qr",
        "loads of a single rigid body by its rows",
        (ROWS, MOTION),
        (ROW_LOAD, E),
        (
            Equation("bias acceleration", accelerations, stack(rdd, wd)),
            Equation("w x (w x r_C) sqrt(m)", turning, stack(spin * (spin * arm), sp.zeros(3, 1))),
            Equation("d", ROW_LOAD.symbol, u * accelerations + turning),
            Equation("rows of J_C", inertia_rows, inner),
            Equation("J_C w", spun, inertia_rows.T * (inertia_rows * w)),
            Equation("w x J_C w", E.symbol, stack(sp.zeros(3, 1), spin * spun)),
        ),
        sources=SOURCES_QR,
    )


def _split_load() -> tuple[tuple[Equation, ...], sp.MatrixSymbol, sp.MatrixSymbol]:
    """d + U^-T e, row by row, and the remainder of e where rows are too small to carry it."""
    u, equations = triangular(ROWS.symbol), []
    carried: list[sp.Expr] = []
    remaining_load: list[sp.Expr] = []
    for i in range(6):
        remainder_i, equation = _scalar_equation(
            f"left_{i + 1}", E.symbol[i, 0] - sum(u[k, i] * carried[k] for k in range(i)),
            f"remaining load for row {i + 1}",
        )  # fmt: skip
        size = sum(u[k, i] ** 2 for k in range(i + 1))
        takes = u[i, i] ** 2 > _MIN_ROW_SHARE**2 * size
        added, adding = _scalar_equation(
            f"taken_{i + 1}",
            sp.Piecewise((remainder_i / u[i, i], takes), (0, True)),
            f"part of row {i + 1}",
        )
        carried_i, carried_equation = _scalar_equation(
            f"rest_{i + 1}",
            sp.Piecewise((0, takes), (remainder_i, True)),
            f"remainder after row {i + 1}",
        )
        equations += [equation, adding, carried_equation]
        carried.append(added)
        remaining_load.append(carried_i)
    whole, remaining = symbol("d_all", 6), symbol("e_rest", 6)
    total = [ROW_LOAD.symbol[i, 0] + carried[i] for i in range(6)]
    equations += [
        Equation("d + U^-T e", whole, sp.ImmutableDenseMatrix(total)),
        Equation("remainder of e", remaining, sp.ImmutableDenseMatrix(remaining_load)),
    ]
    return tuple(equations), whole, remaining


def qr_eliminate(nu: int) -> Derivation:
    """G and g of a hinge, and the rows and loads passed on to its inboard side.

    udot = g - G a_Q with g = R_u^-1 (R_u^-T (tau - H^T e) - d_u); the load outside the range of
    the rows is e_Q = e + G^T (tau - H^T e).
    """
    h = Quantity(_subspace(nu), "", "motion subspace of the free coordinates")
    rotor = Quantity(symbol("J", nu), "kg*m2 or kg", "rotor inertia reflected to the speeds")
    tau = Quantity(symbol("tau", nu), "N, N*m", "efforts on the free coordinates")
    gain, offset = gains(nu)
    equations, load, remaining_load = _split_load()
    rows, pivots = _rotated_rows(nu), _pivots(nu)
    u, subspace_rows, surplus = triangular(ROWS.symbol), symbol("UH", 6, nu), symbol("surplus", nu)
    stacked: sp.Basic = sp.BlockMatrix([[u, load]])
    if nu:
        rotors = sp.ImmutableDenseMatrix(sp.diag(*[sp.sqrt(x) for x in column(rotor.symbol)]))
        stacked = sp.BlockMatrix(
            [[subspace_rows, u, load], [rotors, sp.zeros(nu, 6), sp.zeros(nu, 1)]]
        )
        squares = [
            sum(subspace_rows[i, k] ** 2 for i in range(6)) + rotor.symbol[k, 0] for k in range(nu)
        ]
        equations += (
            Equation("U H", subspace_rows, u * h.symbol),
            Equation("diagonal of D", pivots, sp.ImmutableDenseMatrix(squares)),
            Equation("tau - H^T e", surplus, tau.symbol - h.symbol.T * remaining_load),
        )
    equations += (Equation("rotated rows", rows, Triangle(stacked, nu + 6)),)
    if nu:
        equations += (
            *_gain_equations(nu, rows, surplus),
            Equation(
                "e_Q = e + G^T (tau - H^T e)",
                REMAINING_LOAD.symbol,
                remaining_load + gain.symbol.T * surplus,
            ),
        )
    else:
        equations += (Equation("e_Q = e", REMAINING_LOAD.symbol, remaining_load),)
    outboard_rows = sp.ImmutableDenseMatrix(6, 6, lambda i, j: rows[nu + i, nu + j])
    onward = sp.ImmutableDenseMatrix([rows[nu + i, nu + 6] for i in range(6)])
    equations += (
        Equation("V", CARRIED_ROWS.symbol, _triangle_entries(outboard_rows)),
        Equation("d_V", CARRIED_ROW_LOAD.symbol, onward),
    )
    return Derivation(
        f"generic{nu}",
        f"rows outboard of a hinge with {free_speeds(nu)}",
        (h, rotor, FLOOR, ROWS, ROW_LOAD, E, tau),
        (gain, offset, CARRIED_ROWS, CARRIED_ROW_LOAD, REMAINING_LOAD),
        equations,
        sources=SOURCES_QR,
    )


def _subspace(nu: int) -> sp.MatrixSymbol:
    return symbol("H", 6, nu)


def _rotated_rows(nu: int) -> sp.MatrixSymbol:
    return symbol("R", nu + 6, nu + 7)


def _pivots(nu: int) -> sp.MatrixSymbol:
    return symbol("D_ii", nu)


def _gain_equations(
    nu: int, rows: sp.MatrixSymbol, surplus: sp.MatrixSymbol
) -> tuple[Equation, ...]:
    """G and g by R_u = diag(R_ii) L^T, L with a unit diagonal."""
    gain, offset = gains(nu)
    shares, lower = symbol("shares", nu), symbol("L", nu, nu)
    below, scaled_right = symbol("y", nu), symbol("w", nu)
    scaled = sp.ImmutableDenseMatrix(nu, 6, lambda k, j: shares[k, 0] * rows[k, nu + j])
    efforts = [shares[k, 0] * (shares[k, 0] * below[k, 0] - rows[k, nu + 6]) for k in range(nu)]
    return (
        Equation("1 / R_ii", shares, sp.ImmutableDenseMatrix([1 / rows[k, k] for k in range(nu)])),
        Equation(
            "L", lower,
            sp.ImmutableDenseMatrix(
                nu, nu, lambda j, k: shares[k, 0] * rows[k, j] if j > k else sp.Integer(j == k)
            ),
        ),
        Equation("G = R_u^-1 R_a", gain.symbol, Triangular(lower, scaled, transposed=True)),
        Equation("L^-1 (tau - H^T e)", below, Triangular(lower, surplus)),
        Equation(
            "R_ii^-1 (R_u^-T (tau - H^T e) - d_u)", scaled_right, sp.ImmutableDenseMatrix(efforts)
        ),
        Equation("g", offset.symbol, Triangular(lower, scaled_right, transposed=True)),
    )  # fmt: skip


def qr_guards(nu: int) -> tuple[tuple[sp.Basic, int, str], ...]:
    """Guards of the diagonal of D, and of the remainder of a column after earlier ones."""
    u, rows, pivots = triangular(ROWS.symbol), _rotated_rows(nu), _pivots(nu)
    diagonal = sp.diag(*[sum(u[k, i] ** 2 for k in range(i + 1)) for i in range(6)])
    independent = tuple(
        (
            rows[k, k] ** 2 > _INDEPENDENT * pivots[k, 0],
            1,
            f"pivot {k + 1} of {nu} vanishes: a motion of the hinge is undetermined",
        )
        for k in range(nu)
    )
    return (*pivot_guards(nu, pivots=column(pivots), whole=diagonal), *independent)


def merge() -> Derivation:
    """Add the rows of a hinge to those of the parent, and the remaining load to its e.

    A row V of the hinge is V X of the parent, X = [R^T  -R^T r~; 0  R^T]; rotations combine
    both into one triangle.
    """
    v, parent_rows = triangular(CARRIED_ROWS.symbol), triangular(PARENT_ROWS.symbol)
    linear_part, angular_part = symbol("V_a", 6, 3), symbol("V_r", 6, 3)
    back = R.symbol.T
    linear = sp.ImmutableDenseMatrix(6, 3, lambda i, j: v[i, j])
    angular = sp.ImmutableDenseMatrix(6, 3, lambda i, j: v[i, 3 + j])
    rows = symbol("R", 6, 7)
    triangle = sp.ImmutableDenseMatrix(6, 6, lambda i, j: rows[i, j])
    return Derivation(
        "qr",
        "rows added to those of the parent",
        (R, SHIFT, CARRIED_ROWS, CARRIED_ROW_LOAD, REMAINING_LOAD, PARENT_ROWS, PARENT_ROW_LOAD),
        (ROWS, ROW_LOAD, PARENT_E),
        (
            Equation("V by accelerations at the parent", linear_part, linear * back),
            Equation(
                "V by its angular accelerations",
                angular_part,
                angular * back - linear_part * tilde(column(SHIFT.symbol)),
            ),
            Equation(
                "rotated rows",
                rows,
                Triangle(
                    sp.BlockMatrix(
                        [[parent_rows, PARENT_ROW_LOAD.symbol],
                         [sp.BlockMatrix([[linear_part, angular_part]]), CARRIED_ROW_LOAD.symbol]]
                    ),
                    6,
                ),
            ),
            Equation("U", ROWS.symbol, _triangle_entries(triangle)),
            Equation("d", ROW_LOAD.symbol, sp.ImmutableDenseMatrix([rows[i, 6] for i in range(6)])),
            Equation("X^T e_Q", PARENT_E.symbol, transport(REMAINING_LOAD.symbol)),
        ),
        sources=SOURCES_QR,
    )  # fmt: skip


def rows_to_riccati() -> Derivation:
    """S and e of the rows and loads, for readers of the load at P."""
    u = triangular(ROWS.symbol)
    e = Quantity(symbol("e_S", 6), "N, N*m", "force part of f = S a + e")
    return Derivation(
        "qr",
        "S and e of rows",
        (ROWS, ROW_LOAD, E),
        (S, e),
        (
            Equation("S = U^T U", S.symbol, u.T * u, symmetric=True),
            Equation("U^T d + e", e.symbol, u.T * ROW_LOAD.symbol + E.symbol),
        ),
        sources=SOURCES_QR,
    )
