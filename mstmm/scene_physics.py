"""Can a body have this inertia?  Checks on the tensor itself, free of any choice of axes."""

from __future__ import annotations

import math

from .rotations import Matrix, Vector
from .scene_rules import Location

#: Relative size of a violation that is put down to rounding.
_ROUNDING = 1e-12
_TRIANGLE_ROUNDING = 1e-6


def principal_moments(inertia: Matrix) -> Vector:
    """Eigenvalues of a symmetric 3x3 tensor, ascending (cyclic Jacobi rotations)."""
    a = [list(row) for row in inertia]
    for _ in range(30):  # five suffice; the bound is for entries that are not finite
        if a[0][1] == a[0][2] == a[1][2] == 0:
            break
        for p, q in ((0, 1), (0, 2), (1, 2)):
            _rotate(a, p, q)
    first, second, third = sorted((a[0][0], a[1][1], a[2][2]))
    return (first, second, third)


def _rotate(a: list[list[float]], p: int, q: int) -> None:
    """One Jacobi rotation that makes a[p][q] zero."""
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


def _scaled(inertia: Matrix) -> tuple[Vector, float]:
    """Principal moments divided by the largest entry, and that entry."""
    largest = max(abs(x) for row in inertia for x in row)
    if largest == 0:
        return (0.0, 0.0, 0.0), 1.0
    scaled = [[x / largest for x in row] for row in inertia]
    return principal_moments((_row(scaled[0]), _row(scaled[1]), _row(scaled[2]))), largest


def _row(x: list[float]) -> Vector:
    return (x[0], x[1], x[2])


def inertia_problems(inertia: Matrix) -> list[tuple[Location, str]]:
    """What is wrong with a tensor that has a negative moment about some axis."""
    for entry, label in zip((inertia[i][i] for i in range(3)), ("xx", "yy", "zz"), strict=True):
        if entry < 0:
            return [(
                ("inertia",),
                f"expected moments of inertia of 0 kg m^2 or more, found {label} = {entry:.6g}; "
                "remove the sign",
            )]  # fmt: skip
    moments, scale = _scaled(inertia)
    if moments[0] >= -_ROUNDING * moments[2]:
        return []
    return [(
        ("inertia",),
        f"no body has this tensor: its principal moments are {shown(moments, scale)}, one "
        "negative; check the products of inertia (tensor entries, Jxy = -int xy dm)",
    )]  # fmt: skip


def triangle_excess(inertia: Matrix) -> str | None:
    """What breaks the triangle inequality of the principal moments, None where nothing does.

    Every mass distribution has J1 + J2 >= J3.
    """
    moments, scale = _scaled(inertia)
    if moments[0] + moments[1] >= moments[2] * (1 - _TRIANGLE_ROUNDING):
        return None
    return (
        f"the principal moments {shown(moments, scale)} break the triangle inequality "
        "(each at most the sum of the other two)"
    )


def shown(moments: Vector, scale: float) -> str:
    """Moments as text, in kg m^2."""
    return "[" + ", ".join(f"{m * scale:.4g}" for m in moments) + "] kg m^2"
