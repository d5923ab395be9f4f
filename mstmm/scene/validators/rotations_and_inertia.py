"""Rules for rotations and inertia tensors in their accepted forms, and for possible inertia."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any

from ...numerics.rotations import (
    Matrix,
    Vector,
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


#: Value of the key `orientation` of several tables.
Orientation = Annotated[Numbers, orientation_rule()]


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
        moments = entries(value["moments"])
        axes = from_orientation(orientation_check.check(value["orientation"]))
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


# --- physically possible inertia ------------------------------------------------------------------


#: Relative size of a violation that counts as rounding.
_MAX_MOMENT_ROUNDING = 1e-12
_MAX_TRIANGLE_ROUNDING = 1e-6
#: Radius of gyration (m) below which inertia is rounding: no body of a scene is that small.
_MIN_GYRATION_RADIUS = 1e-8


def principal_moments(inertia: Sequence[Sequence[float]]) -> Vector:
    """Eigenvalues of a symmetric 3x3 tensor, ascending (cyclic Jacobi rotations)."""
    a = [list(row) for row in inertia]
    for _ in range(30):  # five suffice; the bound ends the loop where entries are not finite
        if a[0][1] == a[0][2] == a[1][2] == 0:
            break
        for p, q in ((0, 1), (0, 2), (1, 2)):
            _rotate_jacobi(a, p, q)
    smallest, middle, largest = sorted((a[0][0], a[1][1], a[2][2]))
    return (smallest, middle, largest)


def _rotate_jacobi(a: list[list[float]], p: int, q: int) -> None:
    """Apply one Jacobi rotation that makes a[p][q] zero."""
    if a[p][q] == 0:
        return
    half = (a[q][q] - a[p][p]) / (2 * a[p][q])
    t = 0.0 if math.isinf(half) else math.copysign(1, half) / (abs(half) + math.hypot(1, half))
    c = 1 / math.hypot(1, t)
    s, r = t * c, 3 - p - q
    change = t * a[p][q]
    a[p][p] -= change
    a[q][q] += change
    a[p][q] = a[q][p] = 0.0
    arp, arq = a[r][p], a[r][q]
    a[r][p] = a[p][r] = c * arp - s * arq
    a[r][q] = a[q][r] = s * arp + c * arq


def _scaled_moments(inertia: Matrix) -> tuple[Vector, float]:
    """Principal moments divided by the largest entry, and that entry."""
    largest = max(abs(x) for row in inertia for x in row)
    if largest == 0:
        return (0.0, 0.0, 0.0), 1.0
    return principal_moments([[x / largest for x in row] for row in inertia]), largest


def _is_definite(m: Matrix) -> bool:
    """Whether a symmetric tensor is positive definite, by its pivots.

    This is much faster than computing the eigenvalues.
    """
    (a, b, c), (_, d, e), (_, _, f) = m
    if not a > 0 or not d - b * b / a > 0:
        return False
    pivot = d - b * b / a
    return f - c * c / a - (e - b * c / a) ** 2 / pivot > 0


def is_rounding(entry: float, others: float, mass: float) -> bool:
    """Whether a moment of inertia (kg m^2) is rounding.

    It is rounding if it is negligible against the largest entry of its tensor.  It also is if its
    radius of gyration with the mass (kg) is below that of any body.
    """
    return abs(entry) <= max(_MAX_MOMENT_ROUNDING * others, mass * _MIN_GYRATION_RADIUS**2)


def without_rounding(inertia: Matrix, mass: float) -> Matrix:
    """Set moments that are negative by rounding to zero; other tensors are returned unchanged."""
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    if xx >= 0 and yy >= 0 and zz >= 0:
        return inertia
    largest = max(abs(x) for row in inertia for x in row)
    xx, yy, zz = (0.0 if x < 0 and is_rounding(x, largest, mass) else x for x in (xx, yy, zz))
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def negative_moment_message(inertia: Matrix) -> str | None:
    """Message about a tensor with a negative moment about some axis; None for others."""
    for entry, label in zip((inertia[i][i] for i in range(3)), ("xx", "yy", "zz"), strict=True):
        if entry < 0:
            return (
                f"expected moments of inertia of 0 kg m^2 or more, found {label} = {entry:.6g}; "
                "remove the sign"
            )
    if _is_definite(inertia):
        return None
    moments, scale = _scaled_moments(inertia)
    if moments[0] >= -_MAX_MOMENT_ROUNDING * moments[2]:
        return None
    return (
        f"no body has this tensor: its principal moments are {format_moments(moments, scale)}, one "
        "negative; check the products of inertia (tensor entries, Jxy = -int xy dm)"
    )


def triangle_message(inertia: Matrix) -> str | None:
    """Message about moments that violate the triangle inequality or are negative, or None.

    Every mass distribution has J1 + J2 >= J3: trace(J)/2 - J has no negative eigenvalue.
    """
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
    half = (xx + yy + zz) / 2
    if _is_definite(((half - xx, -xy, -xz), (-xy, half - yy, -yz), (-xz, -yz, half - zz))):
        return None
    moments, scale = _scaled_moments(inertia)
    if moments[0] + moments[1] >= moments[2] * (1 - _MAX_TRIANGLE_ROUNDING):
        return None
    if moments[0] < -_MAX_MOMENT_ROUNDING * abs(moments[2]):
        return f"the principal moments {format_moments(moments, scale)} are not all positive"
    return (
        f"the principal moments {format_moments(moments, scale)} violate the triangle inequality "
        "(each at most the sum of the other two)"
    )


def format_moments(moments: Vector, scale: float) -> str:
    """Format moments as text, in kg m^2."""
    return "[" + ", ".join(f"{m * scale:.4g}" for m in moments) + "] kg m^2"
