"""Helpers for small matrices: symbols, their rows, and stacked columns."""

from __future__ import annotations

import sympy as sp


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
