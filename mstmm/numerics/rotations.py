"""Rotations without numpy: roll-pitch-yaw, quaternions (w, x, y, z) and matrices.

Every function except `to_quaternion` also accepts Duals, with exact derivatives, and Formulas.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from .dual import chain_rule, fsum, has_dual_or_formula, has_formula, hypot, to_real, value_of
from .symbolic_number import cos_sin_with_values, formula, unit_vector_with_values

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix = tuple[Vector, Vector, Vector]

IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def norm(v: Sequence[float]) -> float:
    """Euclidean length without overflow or underflow of the squares."""
    return hypot(v)


def unit_vector(v: Sequence[float]) -> tuple[float, ...]:
    """Unit vector v / |v|, also for very small or large entries.

    A vector that already has unit length to rounding is returned unchanged, so that normalising
    twice changes nothing.  Raises ValueError for a zero or non-finite vector.
    """
    if has_dual_or_formula(v):
        return _dual_unit_vector(v)
    if abs(math.hypot(*v) - 1) <= 1e-15:
        return tuple(float(x) for x in v)
    largest = max(abs(x) for x in v)
    if largest == 0 or not all(math.isfinite(x) for x in v):
        raise ValueError("a vector without direction")
    # A power of two scales exactly.
    scale = 2.0 ** -math.frexp(largest)[1]
    scaled_vector = [x * scale for x in v]
    length = norm(scaled_vector)
    return tuple(x / length for x in scaled_vector)


def _dual_unit_vector(v: Sequence[float]) -> tuple[float, ...]:
    """Unit vector of Duals: d(v/|v|) = (1 - n n^T) dv / |v|, also where |v| is 1 to rounding."""
    values = [value_of(x) for x in v]
    n, length = unit_vector(values), norm(values)
    if has_formula(v):
        return unit_vector_with_values(v, n)
    return tuple(
        chain_rule(n[i], [(v[j], ((i == j) - n[i] * n[j]) / length) for j in range(len(v))])
        for i in range(len(v))
    )


def cross(a: Sequence[float], b: Sequence[float]) -> Vector:
    """Cross product a x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Sequence[float], b: Sequence[float]) -> float:
    """Scalar product, rounded once."""
    return fsum([x * y for x, y in zip(a, b, strict=True)])


def to_matrix(matrix: Sequence[Sequence[float]]) -> Matrix:
    """Convert a 3 x 3 matrix to nested tuples."""
    a, b, c = (tuple(to_real(x) for x in row) for row in matrix)
    return ((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2]))


def product(a: Matrix, b: Matrix) -> Matrix:
    """Matrix product a b."""
    if a is IDENTITY or b is IDENTITY:
        return b if a is IDENTITY else a
    if has_dual_or_formula((*a[0], *a[1], *a[2], *b[0], *b[1], *b[2])):
        columns = list(zip(*b, strict=True))
        return to_matrix([[dot(row, column) for column in columns] for row in a])
    row1, row2, row3 = (_row_times(row, b) for row in a)
    return (row1, row2, row3)


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
    row1, row2, row3 = zip(*a, strict=True)
    return (row1, row2, row3)


def rotate(a: Matrix, v: Sequence[float]) -> Vector:
    """Matrix-vector product a v."""
    if a is IDENTITY:
        return (to_real(v[0]), to_real(v[1]), to_real(v[2]))
    x, y, z = (dot(row, v) for row in a)
    return (x, y, z)


def from_quaternion(q: Sequence[float]) -> Matrix:
    """Rotation matrix of the quaternion w, x, y, z, normalised first."""
    w, x, y, z = unit_vector(q)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def cos_sin(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle (rad), exact at the doubles nearest to multiples of pi/2."""
    if has_dual_or_formula([angle]):
        c, s = cos_sin(value_of(angle))
        if has_formula([angle]):
            return cos_sin_with_values(formula(angle), c, s)
        return chain_rule(c, [(angle, -s)]), chain_rule(s, [(angle, c)])
    quarter_turns = round(angle / (math.pi / 2)) if abs(angle) < 1e6 else 0
    if quarter_turns != 0 and angle == quarter_turns * (math.pi / 2):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[quarter_turns % 4]
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


def rotation_about(axis: Sequence[float], angle: float) -> Matrix:
    """Rotation matrix of a rotation by `angle` (rad) about `axis` (normalised first)."""
    x, y, z = unit_vector(axis)
    c, s = cos_sin(angle)
    k = 1 - c
    return (
        (c + x * x * k, x * y * k - z * s, x * z * k + y * s),
        (y * x * k + z * s, c + y * y * k, y * z * k - x * s),
        (z * x * k - y * s, z * y * k + x * s, c + z * z * k),
    )


def perpendicular_vector(axis: Sequence[float]) -> Vector:
    """Unit vector perpendicular to `axis`: from x, or from y where x is nearly parallel."""
    a = unit_vector(axis)
    for start in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
        if abs(dot(a, start)) < 0.9:
            return unit_rejection(start, a)
    raise AssertionError("no direction is near both x and y")


def unit_rejection(v: Sequence[float], axis: Sequence[float]) -> Vector:
    """Unit vector along the component of `v` perpendicular to `axis`.

    Raises ValueError where the two are collinear.
    """
    a, b = unit_vector(axis), unit_vector(v)
    projection = dot(a, b)
    remainder = [bi - projection * ai for ai, bi in zip(a, b, strict=True)]
    if norm(remainder) < 1e-12:
        raise ValueError("the vectors are collinear")
    x, y, z = unit_vector(remainder)
    return (x, y, z)


def to_quaternion(matrix: Matrix) -> Quaternion:
    """Quaternion w, x, y, z (w >= 0) of a rotation matrix."""
    rotation_matrix = matrix
    trace = rotation_matrix[0][0] + rotation_matrix[1][1] + rotation_matrix[2][2]
    squares = (trace, rotation_matrix[0][0], rotation_matrix[1][1], rotation_matrix[2][2])
    largest = squares.index(max(squares))
    if largest == 0:
        q = [
            1 + trace,
            rotation_matrix[2][1] - rotation_matrix[1][2],
            rotation_matrix[0][2] - rotation_matrix[2][0],
            rotation_matrix[1][0] - rotation_matrix[0][1],
        ]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [rotation_matrix[k][j] - rotation_matrix[j][k], 0.0, 0.0, 0.0]
        q[1 + i] = 1 + rotation_matrix[i][i] - rotation_matrix[j][j] - rotation_matrix[k][k]
        q[1 + j] = rotation_matrix[j][i] + rotation_matrix[i][j]
        q[1 + k] = rotation_matrix[k][i] + rotation_matrix[i][k]
    w, x, y, z = unit_vector(q)
    return (w, x, y, z) if w >= 0 else (-w, -x, -y, -z)


# --- poses: position and orientation of one frame in another --------------------------------------


ZERO: Vector = (0.0, 0.0, 0.0)


class Pose(NamedTuple):
    """Pose of a frame in another one: origin (m) and rotation matrix."""

    position: Vector = ZERO
    rotation: Matrix = IDENTITY

    def compose(self, inner: Pose) -> Pose:
        """Compose two poses: `inner` is given in this frame; the result in this frame's parent."""
        x, y, z = rotate(self.rotation, inner.position)
        a, b, c = self.position
        return Pose((a + x, b + y, c + z), product(self.rotation, inner.rotation))

    @property
    def inverse(self) -> Pose:
        """Pose of the parent frame in this frame."""
        inverse_rotation = transpose(self.rotation)
        x, y, z = rotate(inverse_rotation, self.position)
        return Pose((-x, -y, -z), inverse_rotation)


#: Identity pose.
IDENTITY_POSE = Pose()
