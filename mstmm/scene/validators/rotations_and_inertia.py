"""Rules for rotations and inertia tensors in their accepted forms."""

from __future__ import annotations

from typing import Any

from ...numerics.rotations import (
    Matrix,
    cross,
    dot,
    from_orientation,
    norm,
    product,
    to_matrix,
    to_rpy,
    transpose,
    unit_vector,
)
from . import constant_expressions
from .scalars_and_vectors import (
    Numbers,
    Rule,
    check_entries,
    count_text,
    describe_value,
    numbers_rule,
    problem,
    to_python,
)

#: Largest deviation of rotation rows from orthonormal, and largest difference between entries that
#: should be equal, relative to the largest entry of the matrix.
_MAX_RELATIVE_ROUNDING = 1e-6
_ROWS = {
    "type": "array", "minItems": 3, "maxItems": 3, "items": {
        "type": "array", "minItems": 3, "maxItems": 3, "items": {"type": ["number", "string"]}
    },
}  # fmt: skip


def orientation_rule() -> Rule:
    """Rule for an orientation: [roll, pitch, yaw] in rad, a quaternion, or a rotation matrix.

    A quaternion [w, x, y, z] is normalised.  The three rows of a rotation matrix become
    [roll, pitch, yaw].
    """
    expected = "[roll, pitch, yaw] in rad, a quaternion [w, x, y, z] or 3 rows of a rotation matrix"
    inner = numbers_rule(expected, 3, 4)

    def check(value: Any) -> Numbers:
        if (matrix := _matrix_from_rows(value)) is not None:
            return _angles_of_rotation(matrix)
        result: Numbers = inner.check(value)
        return unit_quaternion(result, expected) if len(result) == 4 else result

    return Rule(expected, check, {"anyOf": [*inner.schema["anyOf"], _ROWS]})


def unit_quaternion(q: tuple[float, ...], expected: str, *place: str | int) -> tuple[float, ...]:
    """Normalise a quaternion; raise Refused where its length is below 1e-6."""
    if norm(q) < 1e-6:
        raise problem(
            f"expected {expected}, found a quaternion of zero length; "
            "use [1, 0, 0, 0] for no rotation",
            *place,
        )
    return constant_expressions.keep_written_form(unit_vector(q), q)


def inertia_rule() -> Rule:
    """Rule for an inertia tensor (kg m^2); the result has three or six numbers.

    Accepted are three or six numbers, three rows, or a table of these as `moments` with the
    `orientation_rule` of their axes.
    """
    expected = "[xx, yy, zz] or [xx, yy, zz, xy, xz, yz] in kg m^2, or 3 rows of 3"
    inner, orientation_check = numbers_rule(expected, 3, 6, of="kg m^2"), orientation_rule()

    def entries(value: Any) -> Numbers:
        matrix = _matrix_from_rows(value, "kg m^2")
        result: Numbers = inner.check(value) if matrix is None else _entries_of_symmetric(matrix)
        return result

    def check(value: Any) -> Numbers:
        if not isinstance(value, dict):
            return entries(value)
        if set(value) != {"moments", "orientation"}:
            keys = f"the keys {describe_value(list(value))}" if value else "an empty one"
            raise problem(
                f"expected {expected}, or a table of moments and orientation, found {keys}"
            )
        moments, axes = (
            entries(value["moments"]),
            from_orientation(orientation_check.check(value["orientation"])),
        )
        xx, yy, zz, xy, xz, yz = (*moments, 0.0, 0.0, 0.0)[:6]
        tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return _entries_of_symmetric(product(product(axes, tensor), transpose(axes)))

    table = {
        "type": "object", "required": ["moments", "orientation"], "additionalProperties": False,
        "properties": {"moments": {"anyOf": [*inner.schema["anyOf"], _ROWS]},
                       "orientation": orientation_check.schema},
    }  # fmt: skip
    return Rule(expected, check, {"anyOf": [*inner.schema["anyOf"], _ROWS, table]})


def _matrix_from_rows(value: Any, of: str = "") -> Matrix | None:
    """Matrix from a list of three lists; None for anything else.

    Raises Refused for rows that are not three numbers.
    """
    row_list = to_python(value)
    if not isinstance(row_list, (list, tuple)) or len(row_list) != 3:
        return None
    if not all(isinstance(to_python(row), (list, tuple)) for row in row_list):
        return None
    row_rule = numbers_rule("three numbers", 3, of=of)

    def row(row_list: Any, _: int) -> Any:
        if len(to_python(row_list)) != 3:
            raise problem(
                f"expected 3 rows of 3, found a row of {count_text(len(to_python(row_list)))}"
            )
        return row_rule.check(row_list)

    return to_matrix(check_entries(row_list, "3 rows of 3", row))


def _angles_of_rotation(matrix: Matrix) -> Numbers:
    """Roll, pitch and yaw (rad) of a rotation matrix.  Raises Refused for other matrices."""
    error = max(abs(dot(matrix[i], matrix[j]) - (i == j)) for i in range(3) for j in range(i, 3))
    if not error <= _MAX_RELATIVE_ROUNDING:
        raise problem(
            f"expected a rotation matrix, found rows that are not orthonormal "
            f"(error {error:.2g}); give more digits, or a quaternion"
        )
    if dot(cross(matrix[0], matrix[1]), matrix[2]) < 0:
        raise problem("expected a rotation matrix, found a reflection; reverse one axis")
    return to_rpy(matrix)


def _entries_of_symmetric(matrix: Matrix) -> Numbers:
    """Entries xx, yy, zz, xy, xz, yz of a symmetric matrix.  Raises Refused for others."""
    largest = max(abs(x) for row in matrix for x in row)

    def mean_entry(i: int, j: int) -> float:
        upper, lower = matrix[i][j], matrix[j][i]
        if not abs(upper - lower) <= _MAX_RELATIVE_ROUNDING * largest:
            raise problem(
                f"expected a symmetric tensor, found {describe_value(upper)} at [{i}][{j}] and "
                f"{describe_value(lower)} at [{j}][{i}]"
            )
        return upper if upper == lower else (upper + lower) / 2

    return (*(matrix[i][i] for i in range(3)), mean_entry(0, 1), mean_entry(0, 2), mean_entry(1, 2))
