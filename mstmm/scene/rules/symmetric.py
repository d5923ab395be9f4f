"""6 x 6 stiffness and damping matrices: accepted forms, and checks for energy gain."""

from __future__ import annotations

import math
from typing import Any

from .values import NUMBER, Rule, collect, counted, entries_of, finite, found, plain, refuse

_SIX = range(6)
#: (row, column) of the upper triangle, row by row.
PAIRS = tuple((i, j) for i in _SIX for j in _SIX if i <= j)
#: Largest relative difference of entries that should be equal, and largest negative pivot relative
#: to its diagonal entry.
_ROUNDING = 1e-12

_AXES = ("along x", "along y", "along z", "about x", "about y", "about z")

Triangle = tuple[float, ...]

#: Positions of a 2 x 2 matrix along y and z in the 36 entries of a 6 x 6 matrix.
_ACROSS = (7, 8, 13, 14)
_WHOLE = 36


def six_by_six(linear: str, angular: str) -> Rule:
    """Rule for a 6 x 6 matrix, given in full, as triangle, diagonal, or 2 x 2 along y and z.

    Accepted are 6 numbers (the diagonal), 21 (the upper triangle row by row), six rows of six, all
    36 entries, or two rows of two along y and z.  The result has 6 or 21 numbers, or 36 where the
    matrix is not symmetric.  The units are those of the diagonal, along and about the axes.
    """
    expected = (
        f"6 numbers, three in {linear} and three in {angular}, or a matrix: 6 rows of 6, the 21 of "
        "the upper triangle of a symmetric one, or 2 rows of 2 along y and z"
    )

    def check(value: Any) -> Triangle:
        entries = entries_of(value, expected)
        nested = all(isinstance(plain(row), (list, tuple)) for row in entries)
        if len(entries) in (2, 6) and nested:
            n = len(entries)
            rows = collect(entries, expected, lambda row, i: _row(row, i, n, expected))
            flat = tuple(x for row in rows for x in row)
            return _shortest(flat if n == 6 else _across(flat))
        if len(entries) not in (6, len(PAIRS), _WHOLE):
            raise refuse(f"expected {expected}, found {counted(len(entries))}")
        given = collect(entries, expected, lambda x, i: finite(plain(x), "a number", i))
        return _shortest(given) if len(given) == _WHOLE else given

    array = {"type": "array", "items": {**NUMBER}}
    forms = [array | {"minItems": n, "maxItems": n} for n in (6, len(PAIRS), _WHOLE)]
    for n in (6, 2):
        rows = {"type": "array", "items": {**array, "minItems": n, "maxItems": n}}
        forms.append(rows | {"minItems": n, "maxItems": n})
    return Rule(expected, check, {"anyOf": forms})


def _row(row: Any, i: int, n: int, expected: str) -> tuple[float, ...]:
    entries = plain(row)
    if len(entries) != n:
        raise refuse(f"expected {expected}, found a row of {counted(len(entries))}", i)
    return tuple(finite(plain(x), "a number", i, j) for j, x in enumerate(entries))


def _across(flat: Triangle) -> Triangle:
    found = [0.0] * _WHOLE
    for place, entry in zip(_ACROSS, flat, strict=True):
        found[place] = entry
    return tuple(found)


def _shortest(flat: Triangle) -> Triangle:
    """Shortest form of a matrix: its upper triangle if it is symmetric, else all 36 entries."""
    return flat if _skew(flat) else tuple(flat[6 * i + j] for i, j in PAIRS)


def _skew(flat: Triangle) -> tuple[int, int] | None:
    """Row and column of the first pair of entries that differ across the diagonal."""
    for i, j in PAIRS:
        one, other = flat[6 * i + j], flat[6 * j + i]
        if abs(one - other) > _ROUNDING * max(abs(one), abs(other)):
            return i, j
    return None


def full(given: Triangle) -> list[list[float]]:
    """Full 6 x 6 matrix from its diagonal, its upper triangle or all its entries."""
    if len(given) == _WHOLE:
        return [list(given[6 * i : 6 * i + 6]) for i in _SIX]
    matrix = [[0.0] * 6 for _ in _SIX]
    pairs = PAIRS if len(given) == len(PAIRS) else [(i, i) for i in _SIX]
    for (i, j), entry in zip(pairs, given, strict=True):
        matrix[i][j] = matrix[j][i] = entry
    return matrix


def triangle(given: Triangle) -> Triangle:
    """Upper triangle (21,) of the symmetric part of a matrix, row by row."""
    matrix = full(given)
    return tuple(
        matrix[i][j] if matrix[i][j] == matrix[j][i] else (matrix[i][j] + matrix[j][i]) / 2
        for i, j in PAIRS
    )


def antisymmetric(given: Triangle) -> Triangle:
    """Antisymmetric part (15,) of a matrix above the diagonal, row by row."""
    matrix = full(given)
    return tuple((matrix[i][j] - matrix[j][i]) / 2 for i, j in PAIRS if i != j)


def refuse_nonconservative(given: Triangle, what: str) -> None:
    """Reject a matrix that is not symmetric or has a negative eigenvalue.  Raises Refused."""
    pair = _skew(given) if len(given) == _WHOLE else None
    if pair is not None:
        i, j = pair
        raise refuse(
            f"expected a symmetric matrix, found {found(given[6 * i + j])} at [{i}][{j}] and "
            f"{found(given[6 * j + i])} at [{j}][{i}]; a matrix that is not symmetric has no "
            "potential: set conservative = false if that is intended, as for a journal bearing",
            what,
        )
    axis = _gaining(full(given))
    if axis is not None:
        raise refuse(
            "expected a matrix without negative eigenvalues, found one that adds energy to a "
            f"motion ({_AXES[axis]}); correct its signs or its off-diagonal entries, or set "
            "conservative = false if that is intended",
            what,
        )


def _gaining(matrix: list[list[float]]) -> int | None:
    """Row in which elimination finds a negative pivot; None if it finds none."""
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
