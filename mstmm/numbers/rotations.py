"""Rotations without numpy: roll-pitch-yaw, quaternions (w, x, y, z) and matrices.

Every function except `to_quaternion` also accepts Duals, with exact derivatives, and Formulas.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .dual import chained, formulas, fsum, hypot, moving, real, value_of
from .formula import direction, formula, turn

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def norm(v: Sequence[float]) -> float:
    """Euclidean length without overflow or underflow of the squares."""
    return hypot(v)


def unit(v: Sequence[float]) -> tuple[float, ...]:
    """Unit vector v / |v|, also for very small or large entries.

    A vector that already has unit length to rounding is returned unchanged, so that normalising
    twice changes nothing.  Raises ValueError for a zero or non-finite vector.
    """
    if moving(v):
        return _moving_unit(v)
    if abs(math.hypot(*v) - 1) <= 1e-15:
        return tuple(float(x) for x in v)
    largest = max(abs(x) for x in v)
    if largest == 0 or not all(math.isfinite(x) for x in v):
        raise ValueError("a vector without direction")
    # A power of two scales exactly.
    scale = 2.0 ** -math.frexp(largest)[1]
    scaled = [x * scale for x in v]
    length = norm(scaled)
    return tuple(x / length for x in scaled)


def _moving_unit(v: Sequence[float]) -> tuple[float, ...]:
    """Unit vector of Duals: d(v/|v|) = (1 - n n^T) dv / |v|, also where |v| is 1 to rounding."""
    values = [value_of(x) for x in v]
    n, length = unit(values), norm(values)
    if formulas(v):
        return direction(v, n)
    return tuple(
        chained(n[i], [(v[j], ((i == j) - n[i] * n[j]) / length) for j in range(len(v))])
        for i in range(len(v))
    )


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Cross product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product, rounded once."""
    return fsum([x * y for x, y in zip(a, b, strict=True)])


def rows(matrix: Sequence[Sequence[float]]) -> Matrix:
    """Convert a 3 x 3 matrix to nested tuples."""
    a, b, c = (tuple(real(x) for x in row) for row in matrix)
    return ((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2]))


def product(a: Matrix, b: Matrix) -> Matrix:
    """Matrix product a b."""
    if a is IDENTITY or b is IDENTITY:
        return b if a is IDENTITY else a
    if moving((*a[0], *a[1], *a[2], *b[0], *b[1], *b[2])):
        columns = list(zip(*b, strict=True))
        return rows([[dot(row, column) for column in columns] for row in a])
    first, second, third = (_row_times(row, b) for row in a)
    return (first, second, third)


def _row_times(row: Vector, b: Matrix) -> Vector:
    """Product of a row and a matrix of floats, each entry rounded once."""
    (b00, b01, b02), (b10, b11, b12), (b20, b21, b22) = b
    x, y, z = row
    return (
        math.fsum((x * b00, y * b10, z * b20)),
        math.fsum((x * b01, y * b11, z * b21)),
        math.fsum((x * b02, y * b12, z * b22)),
    )


def transpose(a: Matrix) -> Matrix:
    """Transpose of a 3 x 3 matrix."""
    if a is IDENTITY:
        return a
    first, second, third = zip(*a, strict=True)
    return (first, second, third)


def apply(a: Matrix, v: Sequence[float]) -> Vector:
    """Matrix-vector product a v."""
    if a is IDENTITY:
        return (real(v[0]), real(v[1]), real(v[2]))
    x, y, z = (dot(row, v) for row in a)
    return (x, y, z)


def from_quaternion(q: Sequence[float]) -> Matrix:
    """Rotation matrix of the quaternion w, x, y, z, normalised first."""
    w, x, y, z = unit(q)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def cos_sin(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle (rad), exact at the doubles nearest to multiples of pi/2."""
    if moving([angle]):
        c, s = cos_sin(value_of(angle))
        if formulas([angle]):
            return turn(formula(angle), c, s)
        return chained(c, [(angle, -s)]), chained(s, [(angle, c)])
    quarter = round(angle / (math.pi / 2)) if abs(angle) < 1e6 else 0
    if quarter != 0 and angle == quarter * (math.pi / 2):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter % 4]
    return math.cos(angle), math.sin(angle)


def from_rpy(angles: Sequence[float]) -> Matrix:
    """Rotation matrix Rz(yaw) Ry(pitch) Rx(roll) from (roll, pitch, yaw), rad.

    An angle that is the double nearest to a multiple of a quarter turn gives exact zeros and ones,
    so that frames rotated by right angles stay aligned.
    """
    if tuple(angles) == (0.0, 0.0, 0.0):
        return IDENTITY
    (cr, sr), (cp, sp), (cy, sy) = (cos_sin(angle) for angle in angles)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def to_rpy(matrix: Matrix) -> Vector:
    """Roll, pitch and yaw (rad) of a rotation matrix; yaw is 0 at a pitch of a quarter turn.

    Roll is computed after yaw and in the axes rotated by it.  The three angles therefore reproduce
    the matrix also near such a pitch, where each of them is nearly undetermined.
    """
    (xx, xy, xz), (yx, yy, yz), (zx, _, _) = matrix
    yaw = math.atan2(yx, xx)
    c, s = cos_sin(yaw)
    roll = math.atan2(s * xz - c * yz, c * yy - s * xy)
    return (roll, math.atan2(0.0 - zx, c * xx + s * yx), yaw)


def from_orientation(orientation: Sequence[float]) -> Matrix:
    """Rotation matrix from three numbers (roll, pitch, yaw) or four (quaternion w, x, y, z)."""
    return from_rpy(orientation) if len(orientation) == 3 else from_quaternion(orientation)


def about(axis: Sequence[float], angle: float) -> Matrix:
    """Rotation matrix of a rotation by `angle` (rad) about `axis` (normalised first)."""
    x, y, z = unit(axis)
    c, s = cos_sin(angle)
    k = 1 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


def perpendicular(axis: Sequence[float]) -> Vector:
    """Unit vector perpendicular to `axis`: from x, or from y where x is nearly parallel."""
    a = unit(axis)
    for start in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        if abs(dot(a, start)) < 0.9:
            return reject(start, a)
    raise AssertionError("no direction is near both x and y")


def reject(v: Sequence[float], axis: Sequence[float]) -> Vector:
    """Unit vector along the component of `v` perpendicular to `axis`.

    Raises ValueError where the two are collinear.
    """
    a, b = unit(axis), unit(v)
    along = dot(a, b)
    rest = [bi - along * ai for ai, bi in zip(a, b, strict=True)]
    if norm(rest) < 1e-12:
        raise ValueError("the vectors are collinear")
    x, y, z = unit(rest)
    return (x, y, z)


def to_quaternion(matrix: Matrix) -> Quaternion:
    """Quaternion w, x, y, z (w >= 0) of a rotation matrix."""
    m = matrix
    trace = m[0][0] + m[1][1] + m[2][2]
    squares = (trace, m[0][0], m[1][1], m[2][2])
    largest = squares.index(max(squares))
    if largest == 0:
        q = [1 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [m[k][j] - m[j][k], 0.0, 0.0, 0.0]
        q[1 + i] = 1 + m[i][i] - m[j][j] - m[k][k]
        q[1 + j] = m[j][i] + m[i][j]
        q[1 + k] = m[k][i] + m[i][k]
    w, x, y, z = unit(q)
    return (w, x, y, z) if w >= 0 else (-w, -x, -y, -z)
