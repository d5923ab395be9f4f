"""Rows of constraints between a frame C on a body A and a point of a body B.

C is the frame at the start of the constraint, welded to A, with z along the normal if there is one.
With d from C to the point of B in axes of C a constraint states, as a hinge that closes a loop
(`loop_closure`),

    W       directions of its rows, a force and a moment at the point of B each
    gap     component along W: error of the constraint
    drift   component along W: rate of W slip

so that all later steps are those of a cut hinge.  A point on a curve c(s) is one: C moves along the
curve with a speed s', and the two directions across the curve are constrained.  A point on a plane
has the row z of a weld, and height p above C.

A distance l, along n = d / |d|:

    gap = (1 - l / |d|) d,  (n . d')' = n . d'' + (|d'|^2 - (n . d')^2) / |d|

A disc of radius r with its centre at the point of B rolls on the plane z = p of C.  Its axis e is
fixed in B; the contact point is, from its centre,

    rho = -r m / |m|,  m = z - (z . e) e

and a ball has e = 0.  Along z the contact point has the height d_z + rho_z - p, which is a row of
positions; x and y state that B is at rest at the contact point, rows of speeds alone:

    W slip = d' + w x rho,  (d' + w x rho)' = d'' + w' x rho + w x rho'
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde
from ..definition.notation import column, part, stack, symbol
from .hinge import DIRECTIONS
from .loop_closure import OFFSET, ROTATION, VELOCITY_ERROR

#: Least square of a length used as a divisor, m^2: coincident points, a disc that lies flat.
_POINT = sp.Rational(1, 10**24)

_ZERO = sp.ImmutableDenseMatrix([0, 0, 0])
_GAP = Quantity(symbol("gap", 6), "m", "position gap of the constraint, axes of C")
_DRIFT = Quantity(
    symbol("drift", 6),
    "",
    "rate of the velocity error in the bias motion, axes of C",
    accumulate=True,
)
_LENGTH = Quantity(symbol("p", 1), "m", "prescribed distance")
_HEIGHT = Quantity(symbol("p", 1), "m", "height of the plane over C")
_DISC = Quantity(
    symbol("p", 5), "m, -",
    "height of the plane over C, radius of the disc, its axis in axes of B (a ball: 0)",
)  # fmt: skip


def _dot(a: sp.Basic, b: sp.Basic) -> sp.Expr:
    return sum(a[i, 0] * b[i, 0] for i in range(3))


def _scale_vector(factor: sp.Expr, vector: sp.Basic) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix([factor * vector[i, 0] for i in range(3)])


def _norm(vector: sp.Basic) -> sp.Expr:
    return sp.sqrt(sp.Max(_dot(vector, vector), _POINT))


def _line_direction(d: sp.Basic) -> tuple[sp.MatrixSymbol, sp.MatrixSymbol, list[Equation]]:
    """|d| and n = d / |d|, and their equations; n is x for coincident points."""
    size, direction = symbol("size", 1), symbol("n", 3)
    is_distinct = _dot(d, d) > _POINT
    entries = [
        sp.Piecewise((d[i, 0] / size[0, 0], is_distinct), (sp.Integer(i == 0), True))
        for i in range(3)
    ]
    return (
        size,
        direction,
        [
            Equation("|d|", size, sp.ImmutableDenseMatrix([_norm(d)])),
            Equation("n", direction, sp.ImmutableDenseMatrix(entries)),
        ],
    )


def _directions(rows: list[list[sp.Expr]]) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix([*rows, *[[sp.Integer(0)] * 6] * (6 - len(rows))])


def distance() -> Derivation:
    """Row of a distance, along the line between both points."""
    d, length = column(OFFSET.symbol), _LENGTH.symbol[0, 0]
    size, direction, equations = _line_direction(d)
    row = [*(direction[i, 0] for i in range(3)), *[sp.Integer(0)] * 3]
    return Derivation(
        "loops",
        "row of a distance constraint",
        (_LENGTH, OFFSET),
        (DIRECTIONS, _GAP),
        (
            *equations,
            Equation("W", DIRECTIONS.symbol, _directions([row])),
            Equation(
                "gap", _GAP.symbol, stack(_scale_vector(size[0, 0] - length, direction), _ZERO)
            ),
        ),
    )


def distance_drift() -> Derivation:
    """Contribution of the rotating line to the rate of its row."""
    d, speed = column(OFFSET.symbol), part(VELOCITY_ERROR.symbol, 0)
    (size, direction, equations), rate = _line_direction(d), symbol("rate", 1)
    across = (_dot(speed, speed) - rate[0, 0] ** 2) / size[0, 0]
    return Derivation(
        "loops",
        "rate of the row of a distance constraint",
        (OFFSET, VELOCITY_ERROR),
        (_DRIFT,),
        (
            *equations,
            Equation("n . d'", rate, sp.ImmutableDenseMatrix([_dot(direction, speed)])),
            Equation("drift +=", _DRIFT.symbol, stack(_scale_vector(across, direction), _ZERO)),
        ),
    )


def plane() -> Derivation:
    """Row of a point on the plane z = p of C."""
    height = OFFSET.symbol[2, 0] - _HEIGHT.symbol[0, 0]
    row = [sp.Integer(i == 2) for i in range(6)]
    return Derivation(
        "loops",
        "row of a point-on-plane constraint",
        (_HEIGHT, OFFSET),
        (DIRECTIONS, _GAP),
        (
            Equation("W", DIRECTIONS.symbol, _directions([row])),
            Equation("gap", _GAP.symbol, sp.ImmutableDenseMatrix([0, 0, height, 0, 0, 0])),
        ),
    )


def _contact_geometry() -> tuple[tuple[sp.MatrixSymbol, ...], list[Equation]]:
    """e, m, |m| and rho in axes of C, and their equations."""
    e, m, size, lever = symbol("e", 3), symbol("m", 3), symbol("size", 1), symbol("rho", 3)
    axis = part(_DISC.symbol, 2)
    up = sp.ImmutableDenseMatrix([0, 0, 1])
    return (e, m, size, lever), [
        Equation("e", e, ROTATION.symbol.T * axis),
        Equation("m", m, up - _scale_vector(e[2, 0], e)),
        Equation("|m|", size, sp.ImmutableDenseMatrix([_norm(m)])),
        Equation("rho", lever, _scale_vector(-_DISC.symbol[1, 0] / size[0, 0], m)),
    ]


def rolling() -> Derivation:
    """Rows of a disc or ball on the plane z = p of C: slip along x and y, height along z."""
    (_, _, _, lever), equations = _contact_geometry()
    rows = []
    for axis in range(3):
        force = sp.ImmutableDenseMatrix([sp.Integer(i == axis) for i in range(3)])
        moment = tilde(column(lever)) * force
        rows.append([*force, *(moment[i, 0] for i in range(3))])
    height = OFFSET.symbol[2, 0] + lever[2, 0] - _DISC.symbol[0, 0]
    return Derivation(
        "loops",
        "rows of a disc that rolls on a plane",
        (_DISC, ROTATION, OFFSET),
        (DIRECTIONS, _GAP),
        (
            *equations,
            Equation("W", DIRECTIONS.symbol, _directions(rows)),
            Equation("gap", _GAP.symbol, sp.ImmutableDenseMatrix([0, 0, height, 0, 0, 0])),
        ),
    )


def rolling_drift() -> Derivation:
    """Contribution of the moving contact point to the rate of the rows: w x rho'."""
    (e, m, size, _), equations = _contact_geometry()
    spin = column(part(VELOCITY_ERROR.symbol, 3))
    e_rate, m_rate, size_rate = symbol("e_d", 3), symbol("m_d", 3), symbol("size_d", 1)
    lever_rate = symbol("rho_d", 3)
    shrinking = _scale_vector(size_rate[0, 0] / size[0, 0], m)
    contact_rate = _scale_vector(-_DISC.symbol[1, 0] / size[0, 0], m_rate - shrinking)
    return Derivation(
        "loops",
        "rate of the rows of a disc that rolls on a plane",
        (_DISC, ROTATION, VELOCITY_ERROR),
        (_DRIFT,),
        (
            *equations[:-1],
            Equation("e'", e_rate, tilde(spin) * e),
            Equation(
                "m'", m_rate, -_scale_vector(e_rate[2, 0], e) - _scale_vector(e[2, 0], e_rate)
            ),
            Equation("|m|'", size_rate, sp.ImmutableDenseMatrix([_dot(m, m_rate) / size[0, 0]])),
            Equation("rho'", lever_rate, contact_rate),
            Equation("drift +=", _DRIFT.symbol, stack(tilde(spin) * lever_rate, _ZERO)),
        ),
    )


#: Least sine of the angle between the axis of a rolling disc and the normal of its plane.
_FLAT = sp.Rational(1, 10**3)
#: Singular cases: (condition, failure code, message) by kernel.
GUARDS: dict[str, tuple[tuple[sp.Basic, int, str], ...]] = {
    "rolling": ((symbol("size", 1)[0, 0] > _FLAT, 1, "the disc lies flat on its plane"),)
}

#: Kernels of constraints, in their order.
STEPS = (distance, distance_drift, plane, rolling, rolling_drift)
