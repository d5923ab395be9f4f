"""Checks whether an inertia tensor is physically possible, for any choice of axes."""

from __future__ import annotations

import math

from ...numerics.rotations import Matrix, Vector

#: Relative size of a violation that counts as rounding.
_MAX_RELATIVE_ROUNDING = 1e-12
_MAX_TRIANGLE_ROUNDING = 1e-6
#: Radius of gyration (m) below which inertia is rounding: no body of a scene is that small.
_MIN_GYRATION_RADIUS = 1e-8


def principal_moments(inertia: Matrix) -> Vector:
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
    scaled_rows = [[x / largest for x in row] for row in inertia]
    return principal_moments(
        (_row(scaled_rows[0]), _row(scaled_rows[1]), _row(scaled_rows[2]))
    ), largest


def _is_definite(m: Matrix) -> bool:
    """Whether a symmetric tensor is positive definite, by its pivots.

    This is much faster than computing the eigenvalues.
    """
    (a, b, c), (_, d, e), (_, _, f) = m
    if not a > 0 or not d - b * b / a > 0:
        return False
    pivot = d - b * b / a
    return f - c * c / a - (e - b * c / a) ** 2 / pivot > 0


def _row(x: list[float]) -> Vector:
    return (x[0], x[1], x[2])


def is_rounding(entry: float, others: float, mass: float) -> bool:
    """Whether a moment of inertia (kg m^2) is rounding.

    It is rounding if it is negligible against the largest entry of its tensor.  It also is if its
    radius of gyration with the mass (kg) is below that of any body.
    """
    return abs(entry) <= max(_MAX_RELATIVE_ROUNDING * others, mass * _MIN_GYRATION_RADIUS**2)


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
    if moments[0] >= -_MAX_RELATIVE_ROUNDING * moments[2]:
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
    if moments[0] < -_MAX_RELATIVE_ROUNDING * abs(moments[2]):
        return f"the principal moments {format_moments(moments, scale)} are not all positive"
    return (
        f"the principal moments {format_moments(moments, scale)} violate the triangle inequality "
        "(each at most the sum of the other two)"
    )


def format_moments(moments: Vector, scale: float) -> str:
    """Format moments as text, in kg m^2."""
    return "[" + ", ".join(f"{m * scale:.4g}" for m in moments) + "] kg m^2"
