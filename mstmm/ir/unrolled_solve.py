"""Unrolled solution of small linear systems on the nodes of a graph; every pivot is guarded."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise

from mstmm.ir.graph import Graph, Node

NodeMatrix = list[list[Node]]
#: Receives the condition that a pivot must satisfy, and its index.
PivotGuard = Callable[[Node, int], None]

#: Failure code of a vanishing pivot, as the driver of the sweep expects it.
SINGULAR = 1
#: Smallest pivot relative to its diagonal entry (to its row where rows are exchanged).
RELATIVE_PIVOT = Fraction(1, 10**13)


def factor_ldl(
    graph: Graph,
    matrix: NodeMatrix,
    guard: PivotGuard | None = None,
    relative_pivot: Fraction = RELATIVE_PIVOT,
) -> tuple[NodeMatrix, list[Node]]:
    """Factor A = L diag(d) L^T row by row: (rows of L left of its unit diagonal, 1 / d).

    The upper half of A is read.  `guard` receives the conditions on pivots; without it they become
    guards of the graph.

    Each pivot has its division.  One division for two pivots (by the minor a c - b^2) is as
    accurate, but its products cost what the division saves (measured on ball hinges).
    """
    n = len(matrix)
    products: NodeMatrix = [[] for _ in range(n)]
    lower: NodeMatrix = [[] for _ in range(n)]
    reciprocal: list[Node] = []
    for i in range(n):
        for j in range(i):
            value = matrix[j][i]
            for k in range(j):
                value = value - products[i][k] * lower[j][k]
            products[i].append(value)  # L_ij d_j
            lower[i].append(value * reciprocal[j])
        pivot = matrix[i][i]
        for k in range(i):
            pivot = pivot - products[i][k] * lower[i][k]
        condition = _pivot_condition(graph, pivot, matrix[i][i], relative_pivot)
        if guard is None:
            _guard_pivot(graph, condition, i, n)
        else:
            guard(condition, i)
        reciprocal.append(1 / pivot)
    return lower, reciprocal


def forward_substitute(lower: NodeMatrix, column: list[Node]) -> list[Node]:
    """Forward substitution L^-1 b, in place; only entries left of the diagonal of L are read."""
    for i in range(len(column)):
        for k in range(i):
            column[i] = column[i] - lower[i][k] * column[k]
    return column


def back_substitute(lower: NodeMatrix, column: list[Node]) -> list[Node]:
    """Back-substitution L^-T b, in place; only entries left of the diagonal of L are read."""
    n = len(column)
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            column[i] = column[i] - lower[k][i] * column[k]
    return column


def solve_symmetric(
    graph: Graph,
    matrix: NodeMatrix,
    right: NodeMatrix,
    guard: PivotGuard | None = None,
    relative_pivot: Fraction = RELATIVE_PIVOT,
) -> NodeMatrix:
    """Solve A^-1 B by LDL^T; the other arguments are those of `factor_ldl`."""
    lower, reciprocal = factor_ldl(graph, matrix, guard, relative_pivot)
    columns = []
    for column in zip(*right, strict=True):
        scaled = forward_substitute(lower, list(column))
        scaled = [value * r for value, r in zip(scaled, reciprocal, strict=True)]
        columns.append(back_substitute(lower, scaled))
    return [list(row) for row in zip(*columns, strict=True)]


def solve_pivoted(graph: Graph, matrix: NodeMatrix, right: NodeMatrix) -> NodeMatrix:
    """Solve A^-1 B with row exchange by selection; the size of a row is exchanged with it."""
    n, width = len(matrix), len(matrix) + len(right[0])
    rows = [[*m, *r, _row_norm(graph, m)] for m, r in zip(matrix, right, strict=True)]
    reciprocal: list[Node] = []
    for i in range(n):
        _exchange_pivot_row(graph, rows, i)
        condition = _pivot_condition(graph, graph.call("abs", rows[i][i]), rows[i][width])
        _guard_pivot(graph, condition, i, n)
        reciprocal.append(1 / rows[i][i])
        for k in range(i + 1, n):
            factor = rows[k][i] * reciprocal[i]
            for j in range(i + 1, width):
                rows[k][j] = rows[k][j] - factor * rows[i][j]
    for i in reversed(range(n)):
        for j in range(n, width):
            value = rows[i][j]
            for k in range(i + 1, n):
                value = value - rows[i][k] * rows[k][j]
            rows[i][j] = value * reciprocal[i]
    return [row[n:width] for row in rows]


def factor_reverse_lu(
    graph: Graph, matrix: NodeMatrix, relative_pivot: Fraction = RELATIVE_PIVOT
) -> NodeMatrix:
    """Factor A = U L from the last unknown to the first, without row exchange.

    L is stored below and on the diagonal, with 1 / L_ii on it, and U with a unit diagonal above.
    In this order (tips to root) the factorisation of a tree has no fill-in.  Every pivot is guarded
    to be positive, as the pivots of matrices near a positive definite one are.
    """
    n = len(matrix)
    rows = [list(row) for row in matrix]
    for i in reversed(range(n)):
        _guard_pivot(graph, _pivot_condition(graph, rows[i][i], matrix[i][i], relative_pivot), i, n)
        rows[i][i] = 1 / rows[i][i]
        for k in range(i):
            rows[k][i] = rows[k][i] * rows[i][i]
            for j in range(i):
                rows[k][j] = rows[k][j] - rows[k][i] * rows[i][j]
    return rows


def solve_reverse_lu(factors: NodeMatrix, right: list[Node]) -> list[Node]:
    """Solve A^-1 b from the factors of `factor_reverse_lu`."""
    n, solution = len(right), list(right)
    for i in reversed(range(n)):
        for k in range(i):
            solution[k] = solution[k] - factors[k][i] * solution[i]
    for i in range(n):
        for j in range(i):
            solution[i] = solution[i] - factors[i][j] * solution[j]
        solution[i] = solution[i] * factors[i][i]
    return solution


def givens_triangle(graph: Graph, matrix: NodeMatrix, count: int) -> NodeMatrix:
    """First `count` rows of R in A = Q R, by Givens rotations of neighbouring rows.

    The rotations proceed column by column, the lowest row first, and skip entries known to be
    zero.  No diagonal entry of R is negative.  A small row keeps its digits next to a large one,
    whatever their order; reflections of whole columns do not ensure that (Bjoerck, Numerical
    Methods for Least Squares Problems, 1996, ch. 4, on weighted problems).
    """
    rows = [list(row) for row in matrix]
    zero, one = graph.constant(0), graph.constant(1)
    for k in range(count):
        nonzero_rows = [i for i in range(k, len(rows)) if rows[i][k].value != 0]
        for upper, lower in reversed(list(pairwise(nonzero_rows))):
            _rotate_rows(graph, rows, upper, lower, k)
        if nonzero_rows and nonzero_rows[0] != k:
            rows[k], rows[nonzero_rows[0]] = rows[nonzero_rows[0]], rows[k]
        if len(nonzero_rows) == 1:
            sign = graph.select(graph.call("lt", rows[k][k], zero), -one, one)
            rows[k] = [sign * entry for entry in rows[k]]
    return rows[:count]


def _rotate_rows(graph: Graph, rows: NodeMatrix, upper: int, lower: int, k: int) -> None:
    """Rotate two rows so that entry k of the lower is zero and that of the upper positive.

    Where both entries are zero the rows stay unchanged.
    """
    a, b = rows[upper][k], rows[lower][k]
    zero, one = graph.constant(0), graph.constant(1)
    length = graph.call("sqrt", a * a + b * b)
    is_nonzero = graph.call("lt", zero, length)
    inverse_length = 1 / graph.select(is_nonzero, length, one)
    c, s = graph.select(is_nonzero, a * inverse_length, one), b * inverse_length
    pairs = list(zip(rows[upper], rows[lower], strict=True))
    rows[upper] = [c * x + s * y for x, y in pairs]
    rows[lower] = [c * y - s * x for x, y in pairs]
    rows[upper][k], rows[lower][k] = length, zero


def _row_norm(graph: Graph, row: list[Node]) -> Node:
    total = graph.constant(0)
    for entry in row:
        total = total + graph.call("abs", entry)
    return total


def _exchange_pivot_row(graph: Graph, rows: NodeMatrix, i: int) -> None:
    """Move the row whose entry i is largest in magnitude to row i."""
    for k in range(i + 1, len(rows)):
        if rows[k][i].value == 0:
            continue
        swap = graph.call("lt", graph.call("abs", rows[i][i]), graph.call("abs", rows[k][i]))
        upper = [graph.select(swap, b, a) for a, b in zip(rows[i], rows[k], strict=True)]
        rows[k] = [graph.select(swap, a, b) for a, b in zip(rows[i], rows[k], strict=True)]
        rows[i] = upper


def _pivot_condition(
    graph: Graph, pivot: Node, diagonal: Node, relative_pivot: Fraction = RELATIVE_PIVOT
) -> Node:
    limit = graph.constant(relative_pivot) * diagonal
    if pivot is diagonal:  # a first pivot is compared with zero only
        limit = graph.constant(0)
    return graph.call("lt", limit, pivot)


def _guard_pivot(graph: Graph, condition: Node, i: int, n: int) -> None:
    graph.guard(
        condition, SINGULAR, f"pivot {i + 1} of {n} vanishes: a motion of the hinge is undetermined"
    )
