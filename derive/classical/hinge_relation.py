"""Matrix of a classical hinge: the next hinge's condition gives its free acceleration.

A hinge alone does not determine its free accelerations.  The books use the effort condition L (m,
q)_N = t of the hinge outboard of the next body: with the state outboard of the hinge z_O = E z_I +
G alpha and the force rows F of the outboard body's transfer matrix,

    (L F G) alpha = t - L F E z_I,        U_hinge = E + G K,   K = (L F G)^-1 (t - L F E).

The pivot L F G depends on one body only and may vanish in systems that are perfectly regular.
`margin` measures how close it is: 1 / |(L F G)^-1| (|L| F_scale |G|) in the row-sum norm, at most
about 1, and zero when the pivot vanishes.  `pivot_guards` stops the kernel below `PIVOT_LIMIT`.
"""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve
from ..definition.notation import Matrix, residual, solve_linear
from .state_vector import BOOK, StateVector, append_affine_row

#: Relative size below which a pivot counts as zero, and the failure code of the kernel.
PIVOT_LIMIT = sp.Rational(1, 10**8)
VANISHING_PIVOT = 2


@dataclass(frozen=True)
class HingeStatement:
    """Premises of one classical hinge, from which elimination derives its matrix.

    `premises` give the outboard state (end O) from the inboard state (end I) and the
    free accelerations; `conditions` are the next hinge's equations for m and q at the output end N
    of the outboard body; `bias` are definitions that the premises use.
    """

    element: str
    title: str
    state: StateVector
    free: sp.MatrixSymbol
    inputs: tuple[Quantity, ...]
    premises: tuple[Equation, ...]
    conditions: tuple[Equation, ...]
    source: str
    equation: str
    bias: tuple[Equation, ...] = ()
    notes: tuple[str, ...] = ()


def derivation(statement: HingeStatement) -> Derivation:
    """Definitions of U_h (z_O = U_h z_I) and of the pivot's margin."""
    state = statement.state
    n, freedoms = state.length, int(statement.free.rows)
    body = sp.MatrixSymbol("U", n, n)
    scale = sp.MatrixSymbol("F_scale", state.accelerations, state.accelerations)
    return Derivation(
        element=statement.element,
        title=statement.title,
        inputs=(
            Quantity(body, state.unit, "transfer matrix of the outboard body"),
            Quantity(scale, "kg*m, kg*m2; kg, kg*m", "F_scale of the outboard body"),
            *statement.inputs,
        ),
        outputs=(
            Quantity(sp.MatrixSymbol("U_h", n, n), state.unit, "transfer matrix, z_O = U_h z_I"),
            Quantity(sp.MatrixSymbol("margin", 1, 1), "1", "relative size of the pivot, 0 to 1"),
        ),
        definitions=(
            *statement.bias,
            *_relation_equations(statement, body),
            *_elimination_equations(n, freedoms, statement.equation),
            *_margin_equations(statement, scale),
        ),
        premises=(*statement.premises, *statement.conditions),
        sources=(f"{BOOK}, {statement.source}",),
        notes=(
            "State in inertial axes; the outboard body's next hinge frees as many directions.",
            "The relation fails where the pivot vanishes: use the Riccati sweep there.",
            *statement.notes,
        ),
    )


def elimination_matrices(statement: HingeStatement) -> tuple[Matrix, Matrix]:
    """E and G of z_O = E z_I + G alpha (n x n and n x freedoms), solved from the premises."""
    state = statement.state
    freedoms = int(statement.free.rows)
    rows = solve_linear(
        statement.premises, state.end_blocks("O"), (*state.end_blocks("I"), statement.free)
    )
    state_columns = state.length - 1
    constant = rows[:, state_columns + freedoms :]
    carried_state = append_affine_row(Matrix(rows[:, :state_columns].row_join(constant)))
    free = Matrix(rows[:, state_columns : state_columns + freedoms].col_join(sp.zeros(1, freedoms)))
    return carried_state, free


def condition_rows(statement: HingeStatement) -> tuple[Matrix, Matrix]:
    """L and t of the next hinge's condition L (m, q)_N = t (freedoms x efforts, freedoms x 1)."""
    efforts = statement.state.end_blocks("N")[2:]
    residuals = sp.Matrix.vstack(*(residual(equation) for equation in statement.conditions))
    columns = sp.Matrix([symbol[i, 0] for symbol in efforts for i in range(int(symbol.rows))])
    rows = residuals.jacobian(columns)
    remainder = (residuals - rows * columns).applyfunc(sp.expand)
    if rows.rows != int(statement.free.rows):
        raise ValueError(
            f"{statement.element}: {rows.rows} conditions for {statement.free.rows} free directions"
        )
    return Matrix(rows), Matrix(-remainder)


def _relation_equations(statement: HingeStatement, body: sp.MatrixSymbol) -> tuple[Equation, ...]:
    state = statement.state
    carry, free = elimination_matrices(statement)
    rows, effort = condition_rows(statement)
    first, n, freedoms = state.accelerations, state.length, rows.rows
    outboard = Matrix(first, n, lambda i, j: body[first + i, j])
    right = Matrix(sp.zeros(freedoms, n - 1).row_join(effort))
    return (
        Equation("carried state", sp.MatrixSymbol("E", n, n), carry, "", "z_O at zero alpha"),
        Equation("free directions", sp.MatrixSymbol("G", n, freedoms), free, "", "d z_O / d alpha"),
        Equation(
            "next hinge's condition", sp.MatrixSymbol("L", freedoms, first), rows,
            "", "rows on (m, q) at the output end of the outboard body",
        ),
        Equation("next hinge's effort", sp.MatrixSymbol("T", freedoms, n), right),
        Equation(
            "force rows of the outboard body", sp.MatrixSymbol("F", first, n), outboard,
            "", "rows m and q of its transfer matrix",
        ),
    )  # fmt: skip


def _elimination_equations(n: int, freedoms: int, equation: str) -> tuple[Equation, ...]:
    carry, free = sp.MatrixSymbol("E", n, n), sp.MatrixSymbol("G", n, freedoms)
    rows = sp.MatrixSymbol("L", freedoms, (n - 1) // 2)
    effort, outboard = sp.MatrixSymbol("T", freedoms, n), sp.MatrixSymbol("F", (n - 1) // 2, n)
    pivot, right = sp.MatrixSymbol("P", freedoms, freedoms), sp.MatrixSymbol("R", freedoms, n)
    solution = sp.MatrixSymbol("KV", freedoms, n + freedoms)
    gain, inverse = sp.MatrixSymbol("K", freedoms, n), sp.MatrixSymbol("V", freedoms, freedoms)
    right_sides = sp.BlockMatrix([[right, sp.Identity(freedoms)]])
    return (
        Equation("pivot", pivot, rows * outboard * free),
        Equation("right side", right, effort - rows * outboard * carry),
        Equation("free accelerations", solution, Solve(pivot, right_sides), "", "P^-1 [R, I]"),
        Equation("gain", gain, _column_block(solution, 0, n), "", "alpha = K z_I"),
        Equation("inverse pivot", inverse, _column_block(solution, n, freedoms)),
        Equation("transfer matrix", sp.MatrixSymbol("U_h", n, n), carry + free * gain, equation),
    )


def _column_block(matrix: sp.MatrixSymbol, first: int, count: int) -> Matrix:
    return Matrix(int(matrix.rows), count, lambda i, j: matrix[i, first + j])


def _margin_equations(statement: HingeStatement, scale: sp.MatrixSymbol) -> tuple[Equation, ...]:
    """Pivot scale |L| F_scale |G| and the margin 1 / ||P^-1| scale| (row sums)."""
    freedoms = int(statement.free.rows)
    _, free = elimination_matrices(statement)
    rows, _ = condition_rows(statement)
    acceleration_rows = free[: statement.state.accelerations, :]
    pivot_scale = sp.MatrixSymbol("P_scale", freedoms, freedoms)
    spread = sp.MatrixSymbol("P_spread", freedoms, freedoms)
    inverse = sp.MatrixSymbol("V", freedoms, freedoms)
    sums = [sp.Add(*(spread[i, j] for j in range(freedoms))) for i in range(freedoms)]
    terms = Matrix(rows.applyfunc(sp.Abs)) * scale * Matrix(acceleration_rows.applyfunc(sp.Abs))
    magnitudes = Matrix(inverse.as_explicit().applyfunc(sp.Abs))
    margin = Matrix([[1 / sp.Max(*sums)]])
    return (
        Equation(
            "pivot scale", pivot_scale, terms, "", "magnitude of the terms that make the pivot"
        ),
        Equation("spread", spread, magnitudes * pivot_scale),
        Equation("pivot margin", sp.MatrixSymbol("margin", 1, 1), margin),
    )


def pivot_guards(hinge: Derivation) -> tuple[tuple[sp.Basic, int, str], ...]:
    """Guards for `derive.lower.kernel_lowering.lower`: VANISHING_PIVOT below PIVOT_LIMIT."""
    margin = next(q.symbol for q in hinge.outputs if q.name == "margin")
    return (
        (
            margin[0, 0] > PIVOT_LIMIT,
            VANISHING_PIVOT,
            "the pivot vanishes: no transfer matrix here, use the Riccati sweep",
        ),
    )
