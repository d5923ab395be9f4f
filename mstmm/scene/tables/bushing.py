"""Table [[bushing]]: spring and damper with three forces and three moments between two ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

from pydantic import Field

from ...numerics.rotations import Matrix, from_orientation
from ..validators.names_and_text import Flag, Reference, check_two_ends, name_rule
from ..validators.rotations_and_inertia import Orientation
from ..validators.scalars_and_vectors import (
    NUMBER_SCHEMA,
    Numbers,
    Position,
    Rule,
    Shorthand,
    Table,
    check_entries,
    count_text,
    describe_value,
    numbers_rule,
    problem,
    require_finite,
    require_list,
    to_python,
)
from .body import End, widen_end

_ROWS_RANGE = range(6)
#: (row, column) of the upper triangle, row by row.
UPPER_PAIRS = tuple((i, j) for i in _ROWS_RANGE for j in _ROWS_RANGE if i <= j)
#: Largest relative difference of entries that should be equal, and largest negative pivot relative
#: to its diagonal entry.
_MAX_RELATIVE_ROUNDING = 1e-12

_AXIS_LABELS = ("along x", "along y", "along z", "about x", "about y", "about z")

#: Positions of a 2 x 2 matrix along y and z in the 36 entries of a 6 x 6 matrix.
_BENDING_POSITIONS = (7, 8, 13, 14)
_ENTRY_COUNT = 36


def matrix_6x6(linear: str, angular: str) -> Rule:
    """Rule for a 6 x 6 matrix, given in full, as triangle, diagonal, or 2 x 2 along y and z.

    Accepted are 6 numbers (the diagonal), 21 (the upper triangle row by row), six rows of six, all
    36 entries, or two rows of two along y and z.  The result has 6 or 21 numbers, or 36 where the
    matrix is not symmetric.  The units are those of the diagonal, along and about the axes.
    """
    expected = (
        f"6 numbers, three in {linear} and three in {angular}, or a matrix: 6 rows of 6, the 21 of "
        "the upper triangle of a symmetric one, or 2 rows of 2 along y and z"
    )

    def check(value: Any) -> Numbers:
        entries = require_list(value, expected)
        nested = all(isinstance(to_python(row), (list, tuple)) for row in entries)
        if len(entries) in (2, 6) and nested:
            n = len(entries)
            rows = check_entries(entries, expected, lambda row, i: _check_row(row, i, n, expected))
            flat = tuple(x for row in rows for x in row)
            return _shortest_form(flat if n == 6 else _embed_bending_matrix(flat))
        if len(entries) not in (6, len(UPPER_PAIRS), _ENTRY_COUNT):
            raise problem(f"expected {expected}, found {count_text(len(entries))}")
        checked_entries = check_entries(
            entries, expected, lambda x, i: require_finite(to_python(x), "a number", i)
        )
        return (
            _shortest_form(checked_entries)
            if len(checked_entries) == _ENTRY_COUNT
            else checked_entries
        )

    array = {"type": "array", "items": {**NUMBER_SCHEMA}}
    forms = [array | {"minItems": n, "maxItems": n} for n in (6, len(UPPER_PAIRS), _ENTRY_COUNT)]
    for n in (6, 2):
        rows = {"type": "array", "items": {**array, "minItems": n, "maxItems": n}}
        forms.append(rows | {"minItems": n, "maxItems": n})
    return Rule(expected, check, {"anyOf": forms})


def _check_row(row: Any, i: int, n: int, expected: str) -> tuple[float, ...]:
    entries = to_python(row)
    if len(entries) != n:
        raise problem(f"expected {expected}, found a row of {count_text(len(entries))}", i)
    return tuple(require_finite(to_python(x), "a number", i, j) for j, x in enumerate(entries))


def _embed_bending_matrix(flat: Numbers) -> Numbers:
    entries = [0.0] * _ENTRY_COUNT
    for position, entry in zip(_BENDING_POSITIONS, flat, strict=True):
        entries[position] = entry
    return tuple(entries)


def _shortest_form(flat: Numbers) -> Numbers:
    """Shortest form of a matrix: its upper triangle if it is symmetric, else all 36 entries."""
    return flat if _first_asymmetric_pair(flat) else tuple(flat[6 * i + j] for i, j in UPPER_PAIRS)


def _first_asymmetric_pair(flat: Numbers) -> tuple[int, int] | None:
    """Row and column of the first pair of entries that differ across the diagonal."""
    for i, j in UPPER_PAIRS:
        upper, lower = flat[6 * i + j], flat[6 * j + i]
        if abs(upper - lower) > _MAX_RELATIVE_ROUNDING * max(abs(upper), abs(lower)):
            return i, j
    return None


def full_matrix(given: Numbers) -> list[list[float]]:
    """Full 6 x 6 matrix from its diagonal, its upper triangle or all its entries."""
    if len(given) == _ENTRY_COUNT:
        return [list(given[6 * i : 6 * i + 6]) for i in _ROWS_RANGE]
    matrix = [[0.0] * 6 for _ in _ROWS_RANGE]
    pairs = UPPER_PAIRS if len(given) == len(UPPER_PAIRS) else [(i, i) for i in _ROWS_RANGE]
    for (i, j), entry in zip(pairs, given, strict=True):
        matrix[i][j] = matrix[j][i] = entry
    return matrix


def upper_triangle(given: Numbers) -> Numbers:
    """Upper triangle (21,) of the symmetric part of a matrix, row by row."""
    matrix = full_matrix(given)
    return tuple(
        matrix[i][j] if matrix[i][j] == matrix[j][i] else (matrix[i][j] + matrix[j][i]) / 2
        for i, j in UPPER_PAIRS
    )


def antisymmetric_part(given: Numbers) -> Numbers:
    """Antisymmetric part (15,) of a matrix above the diagonal, row by row."""
    matrix = full_matrix(given)
    return tuple((matrix[i][j] - matrix[j][i]) / 2 for i, j in UPPER_PAIRS if i != j)


def check_conservative(given: Numbers, what: str) -> None:
    """Reject a matrix that is not symmetric or has a negative eigenvalue.  Raises Refused."""
    pair = _first_asymmetric_pair(given) if len(given) == _ENTRY_COUNT else None
    if pair is not None:
        i, j = pair
        raise problem(
            f"expected a symmetric matrix, found {describe_value(given[6 * i + j])} at [{i}][{j}] "
            f"and {describe_value(given[6 * j + i])} at [{j}][{i}]; a matrix that is not symmetric "
            f"has no "
            "potential: set conservative = false if that is intended, as for a journal bearing",
            what,
        )
    axis = _negative_pivot_row(full_matrix(given))
    if axis is not None:
        raise problem(
            "expected a matrix without negative eigenvalues, found one that adds energy to a "
            f"motion ({_AXIS_LABELS[axis]}); correct its signs or its off-diagonal entries, or set "
            "conservative = false if that is intended",
            what,
        )


def _negative_pivot_row(matrix: list[list[float]]) -> int | None:
    """Row in which elimination finds a negative pivot; None if it finds none."""
    sizes = [math.sqrt(abs(matrix[i][i])) for i in _ROWS_RANGE]
    for i, j in UPPER_PAIRS:
        if i != j and matrix[i][j] and not sizes[i] * sizes[j]:
            return i if not sizes[i] else j
    scaled = [
        [matrix[i][j] and matrix[i][j] / sizes[i] / sizes[j] for j in _ROWS_RANGE]
        for i in _ROWS_RANGE
    ]
    for k in _ROWS_RANGE:
        pivot, remaining = scaled[k][k], range(k + 1, 6)
        if pivot < -_MAX_RELATIVE_ROUNDING:
            return k
        if pivot <= _MAX_RELATIVE_ROUNDING:
            if any(abs(scaled[k][j]) > math.sqrt(_MAX_RELATIVE_ROUNDING) for j in remaining):
                return k
            continue
        for i in remaining:
            for j in remaining:
                scaled[i][j] -= scaled[i][k] * scaled[k][j] / pivot
    return None


# --- table ----------------------------------------------------------------------------------------

_SIX_ZEROS = (0.0,) * 6
#: Positions of the translational entries in the upper triangle of a 6 x 6 matrix, with its diagonal
#: and without it.
_TRANSLATIONS, _ANTISYMMETRIC_TRANSLATIONS = (0, 1, 2, 6, 7, 11), (0, 1, 5)


class Bushing(Table):
    """Spring and damper in all six directions: load preload - K e - C e' on `to`.

    The reaction acts on `from`.  The bushing's axes are those of the end `from` (inertial axes for
    the ground), rotated by `orientation`.  The deflection e is the displacement of `to` from `rest`
    (x, y, z in m) with its rotation vector (rad), below 170 degrees.  `rest` is the undeformed pose
    of the end `to` in the bushing's axes; by default it is that of `from`.  `position` (m) is the
    position of an end on the ground.

    With `conservative` false any matrices are accepted, such as those of a journal bearing or a
    seal.  The load -N e of the antisymmetric part N of K then has no potential and counts as work.
    """

    name: Annotated[str, name_rule("the bushing's name")] = ""
    from_: Reference = Field(alias="from")
    to: Reference
    position: Position = (0.0, 0.0, 0.0)
    orientation: Orientation = (0.0, 0.0, 0.0)
    rest: Annotated[
        End,
        Shorthand(
            "[x, y, z] in m, or a table with position and orientation", widen_end, {"type": "array"}
        ),
    ] = End(position=(0.0, 0.0, 0.0))
    stiffness: Annotated[Numbers, matrix_6x6("N/m", "N m/rad")] = _SIX_ZEROS
    damping: Annotated[Numbers, matrix_6x6("N s/m", "N m s/rad")] = _SIX_ZEROS
    preload: Annotated[Numbers, numbers_rule("three forces in N and three moments in N m", 6)] = (
        _SIX_ZEROS
    )
    conservative: Flag = True

    def _check(self) -> None:
        check_two_ends(self, "a bushing", ", so it has no effect")
        if not any((*self.stiffness, *self.damping, *self.preload)):
            raise problem("missing; a bushing needs stiffness, damping or a preload", "stiffness")
        if self.conservative:
            check_conservative(self.stiffness, "stiffness")
            check_conservative(self.damping, "damping")

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from bushing axes to axes of the end `from`."""
        return from_orientation(self.orientation)

    @property
    def numbers(self) -> Numbers:
        """Parameters of the force element: stiffness, damping and preload."""
        matrices, preload = (self.stiffness, self.damping), self.preload
        symmetric: Sequence[int] = range(len(UPPER_PAIRS))
        antisymmetric: Sequence[int] = range(15)
        if self.element == "bearing3":
            symmetric, antisymmetric = _TRANSLATIONS, _ANTISYMMETRIC_TRANSLATIONS
            preload = preload[:3]
        numbers = [triangle[k] for triangle in map(upper_triangle, matrices) for k in symmetric]
        numbers += preload
        if not self.conservative:
            parts = map(antisymmetric_part, matrices)
            numbers += (part[k] for part in parts for k in antisymmetric)
        return tuple(numbers)

    @property
    def element(self) -> str:
        """Name of the force element; one without moments, whose ends may spin, where possible."""
        if self.conservative:
            return "bushing6"
        moments = (matrix[i][j] for matrix in map(full_matrix, (self.stiffness, self.damping))
                   for i in range(6) for j in range(6) if max(i, j) > 2)  # fmt: skip
        return "bearing6" if any((*moments, *self.preload[3:])) else "bearing3"

    @property
    def stiffest(self) -> tuple[float, float]:
        """Largest stiffness along axes (N/m) and about them (N m/rad)."""
        return _largest_entries(self.stiffness)

    @property
    def most_damped(self) -> tuple[float, float]:
        """Largest damping along axes (N s/m) and about them (N m s/rad)."""
        return _largest_entries(self.damping)


def _largest_entries(given: Numbers) -> tuple[float, float]:
    matrix = full_matrix(given)
    translations, rotations = ([abs(matrix[i][j]) for i in indices for j in indices]
                    for indices in (range(3), range(3, 6)))  # fmt: skip
    return max(translations), max(rotations)
