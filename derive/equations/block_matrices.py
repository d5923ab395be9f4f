"""Small matrices of the sweep's equations: symbols, their rows, and columns put together."""

from __future__ import annotations

import sympy as sp


def symbol(name: str, rows: int, columns: int = 1) -> sp.MatrixSymbol:
    """A matrix by its name; a column if nothing else is said."""
    return sp.MatrixSymbol(name, rows, columns)


def part(array: sp.MatrixSymbol, first: int, count: int = 3) -> sp.ImmutableDenseMatrix:
    """Rows first .. first+count of a column."""
    return sp.ImmutableDenseMatrix([array[i, 0] for i in range(first, first + count)])


def column(array: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """A column entry by entry."""
    return part(array, 0, int(array.rows))


def stack(*parts: sp.Basic) -> sp.BlockMatrix:
    """Columns one below the other."""
    return sp.BlockMatrix([[single] for single in parts])


def diagonal(matrix: sp.MatrixSymbol) -> sp.ImmutableDenseMatrix:
    """The diagonal of a square matrix as a column."""
    return sp.ImmutableDenseMatrix([matrix[i, i] for i in range(int(matrix.rows))])
