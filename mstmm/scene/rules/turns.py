"""Rules for rotations and inertia tensors in their accepted forms."""

from __future__ import annotations

from typing import Any

from ...numbers.rotations import (
    Matrix,
    cross,
    dot,
    from_orientation,
    norm,
    product,
    rows,
    to_rpy,
    transpose,
    unit,
)
from . import written
from .values import Numbers, Rule, collect, counted, found, numbers, plain, refuse

#: Largest deviation of rotation rows from orthonormal, and largest difference between entries that
#: should be equal, relative to the largest entry of the matrix.
_ROUNDING = 1e-6
_ROWS = {
    "type": "array", "minItems": 3, "maxItems": 3, "items": {
        "type": "array", "minItems": 3, "maxItems": 3, "items": {"type": ["number", "string"]}
    },
}  # fmt: skip


def orientation() -> Rule:
    """Rule for an orientation: [roll, pitch, yaw] in rad, a quaternion, or a rotation matrix.

    A quaternion [w, x, y, z] is normalised.  The three rows of a rotation matrix become
    [roll, pitch, yaw].
    """
    expected = "[roll, pitch, yaw] in rad, a quaternion [w, x, y, z] or 3 rows of a rotation matrix"
    inner = numbers(expected, 3, 4)

    def check(value: Any) -> Numbers:
        if (matrix := _three_rows(value)) is not None:
            return _angles(matrix)
        result: Numbers = inner.check(value)
        return quaternion(result, expected) if len(result) == 4 else result

    return Rule(expected, check, {"anyOf": [*inner.schema["anyOf"], _ROWS]})


def quaternion(q: tuple[float, ...], expected: str, *place: str | int) -> tuple[float, ...]:
    """Normalise a quaternion; raise Refused where its length is below 1e-6."""
    if norm(q) < 1e-6:
        raise refuse(
            f"expected {expected}, found a quaternion of zero length; "
            "use [1, 0, 0, 0] for no rotation",
            *place,
        )
    return written.alike(unit(q), q)


def inertia() -> Rule:
    """Rule for an inertia tensor (kg m^2); the result has three or six numbers.

    Accepted are three or six numbers, three rows, or a table of these as `moments` with the
    `orientation` of their axes.
    """
    expected = "[xx, yy, zz] or [xx, yy, zz, xy, xz, yz] in kg m^2, or 3 rows of 3"
    inner, turned = numbers(expected, 3, 6, of="kg m^2"), orientation()

    def entries(value: Any) -> Numbers:
        matrix = _three_rows(value, "kg m^2")
        result: Numbers = inner.check(value) if matrix is None else _six(matrix)
        return result

    def check(value: Any) -> Numbers:
        if not isinstance(value, dict):
            return entries(value)
        if set(value) != {"moments", "orientation"}:
            keys = f"the keys {found(list(value))}" if value else "an empty one"
            raise refuse(
                f"expected {expected}, or a table of moments and orientation, found {keys}"
            )
        given, axes = (
            entries(value["moments"]),
            from_orientation(turned.check(value["orientation"])),
        )
        xx, yy, zz, xy, xz, yz = (*given, 0.0, 0.0, 0.0)[:6]
        tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return _six(product(product(axes, tensor), transpose(axes)))

    table = {
        "type": "object", "required": ["moments", "orientation"], "additionalProperties": False,
        "properties": {"moments": {"anyOf": [*inner.schema["anyOf"], _ROWS]},
                       "orientation": turned.schema},
    }  # fmt: skip
    return Rule(expected, check, {"anyOf": [*inner.schema["anyOf"], _ROWS, table]})


def _three_rows(value: Any, of: str = "") -> Matrix | None:
    """Matrix from a list of three lists; None for anything else.

    Raises Refused for rows that are not three numbers.
    """
    given = plain(value)
    if not isinstance(given, (list, tuple)) or len(given) != 3:
        return None
    if not all(isinstance(plain(row), (list, tuple)) for row in given):
        return None
    one = numbers("three numbers", 3, of=of)

    def row(given: Any, _: int) -> Any:
        if len(plain(given)) != 3:
            raise refuse(f"expected 3 rows of 3, found a row of {counted(len(plain(given)))}")
        return one.check(given)

    return rows(collect(given, "3 rows of 3", row))


def _angles(matrix: Matrix) -> Numbers:
    """Roll, pitch and yaw (rad) of a rotation matrix.  Raises Refused for other matrices."""
    off = max(abs(dot(matrix[i], matrix[j]) - (i == j)) for i in range(3) for j in range(i, 3))
    if not off <= _ROUNDING:
        raise refuse(
            f"expected a rotation matrix, found rows that are not orthonormal "
            f"(error {off:.2g}); give more digits, or a quaternion"
        )
    if dot(cross(matrix[0], matrix[1]), matrix[2]) < 0:
        raise refuse("expected a rotation matrix, found a reflection; reverse one axis")
    return to_rpy(matrix)


def _six(matrix: Matrix) -> Numbers:
    """Entries xx, yy, zz, xy, xz, yz of a symmetric matrix.  Raises Refused for others."""
    largest = max(abs(x) for row in matrix for x in row)

    def both(i: int, j: int) -> float:
        one, other = matrix[i][j], matrix[j][i]
        if not abs(one - other) <= _ROUNDING * largest:
            raise refuse(
                f"expected a symmetric tensor, found {found(one)} at [{i}][{j}] and {found(other)} "
                f"at [{j}][{i}]"
            )
        return one if one == other else (one + other) / 2

    return (*(matrix[i][i] for i in range(3)), both(0, 1), both(0, 2), both(1, 2))
