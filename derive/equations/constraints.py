"""Rows of constraints between a frame C on a body A and a point of a body B.

C stands where a constraint begins, z along its normal where it has one, welded to A.  With d from
C to the point of B in axes of C a constraint tells, as a hinge that closes a loop does (`loops`),

    W       directions of its rows, a force and a moment at the point of B each
    gap     what lies along W is how far the constraint is from being met
    drift   what lies along W is the rate of W slip

so that everything behind it is that of any closing hinge.  A point on a curve c(s) is one: C moves
along the curve with a speed s', and of what it then holds the two directions across the curve are
rows.  A point on a plane has the row z of a weld, and is the height p above C.

A distance l, along n = d / |d|:

    gap = (1 - l / |d|) d,  (n . d')' = n . d'' + (|d'|^2 - (n . d')^2) / |d|

A disc of radius r with its centre at the point of B rolls on the plane z = p of C.  Its axis e lies
in B; where it touches is, from its centre,

    rho = -r m / |m|,  m = z - (z . e) e

and a ball has e = 0.  Along z the point of contact has the height d_z + rho_z - p, which is a row
of positions; x and y say that B is at rest where it touches, rows of speeds alone:

    W slip = d' + w x rho,  (d' + w x rho)' = d'' + w' x rho + w x rho'
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde
from .block_matrices import column, part, stack, symbol
from .constrained_directions import DIRECTIONS
from .loop_closure import APART, SLIP, TURN

#: Least square of a length that is divided by, m^2: a point on a point, a disc that lies flat.
_POINT = sp.Rational(1, 10**24)

_ZERO = sp.ImmutableDenseMatrix([0, 0, 0])
_GAP = Quantity(symbol("gap", 6), "m", "what the constraint lacks, axes of C")
_DRIFT = Quantity(
    symbol("drift", 6), "", "rate of the slip in the bias motion, axes of C", accumulate=True
)
_LENGTH = Quantity(symbol("p", 1), "m", "the distance that is kept")
_HEIGHT = Quantity(symbol("p", 1), "m", "height of the plane over C")
_DISC = Quantity(
    symbol("p", 5), "m, -",
    "height of the plane over C, radius of the disc, its axis in axes of B (a ball: 0)",
)  # fmt: skip


def _dot(a: sp.Basic, b: sp.Basic) -> sp.Expr:
    return sum(a[i, 0] * b[i, 0] for i in range(3))


def _scaled(factor: sp.Expr, vector: sp.Basic) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix([factor * vector[i, 0] for i in range(3)])


def _size(vector: sp.Basic) -> sp.Expr:
    return sp.sqrt(sp.Max(_dot(vector, vector), _POINT))


def _line(d: sp.Basic) -> tuple[sp.MatrixSymbol, sp.MatrixSymbol, list[Equation]]:
    """|d| and n = d / |d|, and what they are; of points in one place n is x, so that a distance
    that they are to keep shows."""
    size, along = symbol("size", 1), symbol("n", 3)
    apart = _dot(d, d) > _POINT
    entries = [
        sp.Piecewise((d[i, 0] / size[0, 0], apart), (sp.Integer(i == 0), True)) for i in range(3)
    ]
    return (
        size,
        along,
        [
            Equation("|d|", size, sp.ImmutableDenseMatrix([_size(d)])),
            Equation("n", along, sp.ImmutableDenseMatrix(entries)),
        ],
    )


def _directions(rows: list[list[sp.Expr]]) -> sp.ImmutableDenseMatrix:
    return sp.ImmutableDenseMatrix([*rows, *[[sp.Integer(0)] * 6] * (6 - len(rows))])


def distance() -> Derivation:
    """The row of a distance: along the line between both points."""
    d, length = column(APART.symbol), _LENGTH.symbol[0, 0]
    size, along, line = _line(d)
    row = [*(along[i, 0] for i in range(3)), *[sp.Integer(0)] * 3]
    return Derivation(
        "loops",
        "row of a distance that is kept",
        (_LENGTH, APART),
        (DIRECTIONS, _GAP),
        (
            *line,
            Equation("W", DIRECTIONS.symbol, _directions([row])),
            Equation("gap", _GAP.symbol, stack(_scaled(size[0, 0] - length, along), _ZERO)),
        ),
    )


def distance_drift() -> Derivation:
    """What turning of the line adds to the rate of its row."""
    d, speed = column(APART.symbol), part(SLIP.symbol, 0)
    (size, along, line), rate = _line(d), symbol("rate", 1)
    across = (_dot(speed, speed) - rate[0, 0] ** 2) / size[0, 0]
    return Derivation(
        "loops",
        "rate of the row of a distance",
        (APART, SLIP),
        (_DRIFT,),
        (
            *line,
            Equation("n . d'", rate, sp.ImmutableDenseMatrix([_dot(along, speed)])),
            Equation("drift +=", _DRIFT.symbol, stack(_scaled(across, along), _ZERO)),
        ),
    )


def plane() -> Derivation:
    """The row of a point on the plane z = p of C."""
    height = APART.symbol[2, 0] - _HEIGHT.symbol[0, 0]
    row = [sp.Integer(i == 2) for i in range(6)]
    return Derivation(
        "loops",
        "row of a point on a plane",
        (_HEIGHT, APART),
        (DIRECTIONS, _GAP),
        (
            Equation("W", DIRECTIONS.symbol, _directions([row])),
            Equation("gap", _GAP.symbol, sp.ImmutableDenseMatrix([0, 0, height, 0, 0, 0])),
        ),
    )


def _touching() -> tuple[tuple[sp.MatrixSymbol, ...], list[Equation]]:
    """e, m, |m| and rho in axes of C, and what they are."""
    e, m, size, lever = symbol("e", 3), symbol("m", 3), symbol("size", 1), symbol("rho", 3)
    own = part(_DISC.symbol, 2)
    up = sp.ImmutableDenseMatrix([0, 0, 1])
    return (e, m, size, lever), [
        Equation("e", e, TURN.symbol.T * own),
        Equation("m", m, up - _scaled(e[2, 0], e)),
        Equation("|m|", size, sp.ImmutableDenseMatrix([_size(m)])),
        Equation("rho", lever, _scaled(-_DISC.symbol[1, 0] / size[0, 0], m)),
    ]


def rolling() -> Derivation:
    """Rows of a disc or a ball on the plane z = p of C: slip along x and y, height along z."""
    (_, _, _, lever), equations = _touching()
    rows = []
    for axis in range(3):
        force = sp.ImmutableDenseMatrix([sp.Integer(i == axis) for i in range(3)])
        moment = tilde(column(lever)) * force
        rows.append([*force, *(moment[i, 0] for i in range(3))])
    height = APART.symbol[2, 0] + lever[2, 0] - _DISC.symbol[0, 0]
    return Derivation(
        "loops",
        "rows of a disc that rolls on a plane",
        (_DISC, TURN, APART),
        (DIRECTIONS, _GAP),
        (
            *equations,
            Equation("W", DIRECTIONS.symbol, _directions(rows)),
            Equation("gap", _GAP.symbol, sp.ImmutableDenseMatrix([0, 0, height, 0, 0, 0])),
        ),
    )


def rolling_drift() -> Derivation:
    """What the moving point of contact adds to the rate of the rows: w x rho'."""
    (e, m, size, _), equations = _touching()
    spin = column(part(SLIP.symbol, 3))
    e_rate, m_rate, size_rate = symbol("e_d", 3), symbol("m_d", 3), symbol("size_d", 1)
    lever_rate = symbol("rho_d", 3)
    shrinking = _scaled(size_rate[0, 0] / size[0, 0], m)
    turned = _scaled(-_DISC.symbol[1, 0] / size[0, 0], m_rate - shrinking)
    return Derivation(
        "loops",
        "rate of the rows of a disc that rolls on a plane",
        (_DISC, TURN, SLIP),
        (_DRIFT,),
        (
            *equations[:-1],
            Equation("e'", e_rate, tilde(spin) * e),
            Equation("m'", m_rate, -_scaled(e_rate[2, 0], e) - _scaled(e[2, 0], e_rate)),
            Equation("|m|'", size_rate, sp.ImmutableDenseMatrix([_dot(m, m_rate) / size[0, 0]])),
            Equation("rho'", lever_rate, turned),
            Equation("drift +=", _DRIFT.symbol, stack(tilde(spin) * lever_rate, _ZERO)),
        ),
    )


#: Least sine between the axis of a disc that rolls and the normal of its plane.
_FLAT = sp.Rational(1, 10**3)
#: What cannot be computed: (condition, failure code, message) by kernel.
GUARDS: dict[str, tuple[tuple[sp.Basic, int, str], ...]] = {
    "rolling": ((symbol("size", 1)[0, 0] > _FLAT, 1, "the disc lies flat on its plane"),),
}

#: Kernels of constraints, in their order.
STEPS = (distance, distance_drift, plane, rolling, rolling_drift)
