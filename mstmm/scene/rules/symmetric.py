"""Symmetric matrices of six rows: how they may be written, and that they store or spend energy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .values import NUMBER, Rule, collect, counted, entries_of, finite, found, plain, refuse

_SIX = range(6)
#: Rows and columns of the upper triangle, row by row.
PAIRS = tuple((i, j) for i in _SIX for j in _SIX if i <= j)
#: Entries that should be equal may differ by this part of the larger one, and a pivot may lie below
#: zero by this part of its diagonal entry.
_ROUNDING = 1e-12

_AXES = ("along x", "along y", "along z", "about x", "about y", "about z")

Triangle = tuple[float, ...]


def symmetric(linear: str, angular: str) -> Rule:
    """Six numbers (the diagonal), 21 (the upper triangle row by row) or six rows of six; the result
    has 6 or 21.  The matrix must have no negative eigenvalue.

    The units are those of the diagonal, along and about the axes.
    """
    expected = (
        f"6 numbers, three in {linear} and three in {angular}, or a symmetric matrix: 6 rows of 6, "
        "or the 21 of its upper triangle"
    )

    def check(value: Any) -> Triangle:
        entries = entries_of(value, expected)
        if len(entries) == 6 and all(isinstance(plain(row), (list, tuple)) for row in entries):
            given = _upper(collect(entries, expected, lambda row, i: _row(row, i, expected)))
        elif len(entries) in (6, len(PAIRS)):
            given = collect(entries, expected, lambda x, i: finite(plain(x), "a number", i))
        else:
            raise refuse(f"expected {expected}, found {counted(len(entries))}")
        _refuse_negative(given)
        return given

    array = {"type": "array", "items": {**NUMBER}}
    rows = {"type": "array", "items": {**array, "minItems": 6, "maxItems": 6}}
    forms = [array | {"minItems": n, "maxItems": n} for n in (6, len(PAIRS))]
    return Rule(expected, check, {"anyOf": [*forms, rows | {"minItems": 6, "maxItems": 6}]})


def _row(row: Any, i: int, expected: str) -> tuple[float, ...]:
    entries = plain(row)
    if len(entries) != 6:
        raise refuse(f"expected {expected}, found a row of {counted(len(entries))}", i)
    return tuple(finite(plain(x), "a number", i, j) for j, x in enumerate(entries))


def _upper(rows: Sequence[Sequence[float]]) -> Triangle:
    for i, j in PAIRS:
        one, other = rows[i][j], rows[j][i]
        if abs(one - other) > _ROUNDING * max(abs(one), abs(other)):
            raise refuse(
                f"expected a symmetric matrix, found {found(one)} at [{i}][{j}] and {found(other)} "
                f"at [{j}][{i}]; a matrix that is not symmetric has no potential",
            )
    return tuple(rows[i][j] for i, j in PAIRS)


def full(given: Triangle) -> list[list[float]]:
    """The matrix of its diagonal or of its upper triangle."""
    matrix = [[0.0] * 6 for _ in _SIX]
    pairs = PAIRS if len(given) == len(PAIRS) else [(i, i) for i in _SIX]
    for (i, j), entry in zip(pairs, given, strict=True):
        matrix[i][j] = matrix[j][i] = entry
    return matrix


def triangle(given: Triangle) -> Triangle:
    """Its upper triangle, row by row."""
    matrix = full(given)
    return tuple(matrix[i][j] for i, j in PAIRS)


def _refuse_negative(given: Triangle) -> None:
    axis = _gaining(full(given))
    if axis is not None:
        raise refuse(
            "expected a matrix without negative eigenvalues, found one from which a motion gains "
            f"energy ({_AXES[axis]}); correct its signs, or the entries off its diagonal"
        )


def _gaining(matrix: list[list[float]]) -> int | None:
    """The row in which elimination meets a negative pivot, None where it meets none."""
    sizes = [math.sqrt(abs(matrix[i][i])) for i in _SIX]
    for i, j in PAIRS:
        if i != j and matrix[i][j] and not sizes[i] * sizes[j]:
            return i if not sizes[i] else j
    scaled = [[matrix[i][j] and matrix[i][j] / sizes[i] / sizes[j] for j in _SIX] for i in _SIX]
    for k in _SIX:
        pivot, behind = scaled[k][k], range(k + 1, 6)
        if pivot < -_ROUNDING:
            return k
        if pivot <= _ROUNDING:
            if any(abs(scaled[k][j]) > math.sqrt(_ROUNDING) for j in behind):
                return k
            continue
        for i in behind:
            for j in behind:
                scaled[i][j] -= scaled[i][k] * scaled[k][j] / pivot
    return None
