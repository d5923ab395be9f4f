"""Segments of an exact beam: the motion from one station to the next as a map of strains.

The section at x has the pose g(x) = (R, r).  Its strains xi = [nu; kappa] in section axes (stretch
and shear, twist rate and curvatures) determine the pose,

    R' = R kappa~,   r' = R nu,   that is   g' = g xi^

and are linear in the strain coordinates: xi = xi_0(x) + B(x) eta.  Along a segment of length h the
pose changes by the exponential of Omega, the Magnus series of sixth order (Blanes, Casas, Oteo, Ros
2009) with the strains xi_1, xi_2, xi_3 at three Gauss points:

    B1 = h xi_2,   B2 = sqrt(15)/3 h (xi_3 - xi_1),   B3 = 10/3 h (xi_3 - 2 xi_2 + xi_1)
    C1 = -[B1, B2],   C2 = [B1, 2 B3 + C1] / 60
    Omega = B1 + B3/12 - [-20 B1 - B3 + C1, B2 + C2] / 240

with the bracket [x, y] = [x_w x y_v + x_v x y_w; x_w x y_w].  The brackets have the signs of
g' = g xi^, opposite to those of Y' = A Y.  B1, B2 and B3 are linear in eta as well, so that Omega
is a polynomial and everything else follows from one pose by differentiation: energy is conserved
for any number of segments.

With Omega = [o_v; o_w], s = o_w . o_w and the functions a, b, c of s of `section`, the next
station has

    R = exp(o_w~),   d = (1 + b o_w~ + c o_w~ o_w~) o_v,   [v; w] = T(Omega) Omegad
    T = sum_j (-1)^j ad^j / (j + 1)! = [[T_w, DT_w[o_v]], [0, T_w]]
    T_w = 1 - b o_w~ + c o_w~ o_w~

in its own axes.  T_w is the operator of `section`; the upper right block is its derivative along
o_v.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import Matrix, part, stack
from .modal_residual import ETA, ETAD, modal_columns
from .section import (
    END_ROTATION,
    JACOBIAN,
    MAX_SECTION_ROTATION,
    MOTION_OUTPUTS,
    SQUARE,
    even_series,
)

SOURCES = (
    "Blanes, Casas, Oteo, Ros, The Magnus expansion and some of its applications, 2009, 5.3",
    "Sonneville, Cardona, Bruls, Geometrically exact beam finite element on SE(3), 2014",
    "Simo, A finite strain beam formulation, 1985 (strains in section axes)",
)

REST_STRAINS = Quantity(vector("b", 18), "", "B1, B2, B3 at eta = 0")
STRAIN_SHAPES = modal_columns("Bm", 18, "derivatives of B1, B2, B3 by the strain coordinates")
FIRST_BRACKETS = modal_columns("dC1", 6, "derivatives of C1")
SECOND_BRACKETS = modal_columns("dC2", 6, "derivatives of C2")
FIRST_SUM = modal_columns("dX", 6, "derivatives of X")
#: Omega, its rate, and its second rate at etadd = 0.
POSE = Quantity(vector("Om", 6), "", "Omega: displacement, then rotation vector")
POSE_RATE = Quantity(vector("Omd", 6), "", "rate of Omega")
POSE_BIAS = Quantity(vector("Omdd", 6), "", "second rate of Omega at etadd = 0")


def bracket(x: sp.Basic, y: sp.Basic) -> Matrix:
    """[x, y] of two twists or strains, rows v then w."""
    x_v, x_w, y_v, y_w = (part(z, k) for z in (x, y) for k in (0, 3))
    return Matrix([*(tilde(x_w) * y_v + tilde(x_v) * y_w), *(tilde(x_w) * y_w)])


def bracket_columns(x: sp.Basic, *summands: sp.Basic) -> sp.BlockMatrix:
    """[x, y] for every column y of a sum of arrays with factors."""
    x_v, x_w = tilde(part(x, 0)), tilde(part(x, 3))
    terms = [y.as_coeff_mmul() for y in summands]
    linear, angular = (
        sp.MatAdd(*(factor * array[first : first + 3, :] for factor, array in terms))
        for first in (0, 3)
    )
    return stack(x_w * linear + x_v * angular, x_w * angular)


_POLYNOMIALS = ("C1", "W", "C2", "X", "Y")


def _vectors(name: str) -> list[Matrix]:
    """Entries of an array, of its rate and of its second rate."""
    return [part(vector(f"{name}{dots}", 6), 0, 6) for dots in ("", "d", "dd")]


def _bracket_equations() -> tuple[Equation, ...]:
    """B1, B2, B3, C1, W = 2 B3 + C1, C2, X = -20 B1 - B3 + C1, Y = B2 + C2, and their rates."""
    b, bd = ([part(vector(name, 18), 6 * k, 6) for k in range(3)] for name in ("B", "Bd"))
    (c1, c1d, c1dd), (w, wd, _), (c2, c2d, _), _, _ = map(_vectors, _POLYNOMIALS)

    def define(name: str, value: sp.Basic) -> Equation:
        return Equation(name, vector(name, 6), Matrix(value))

    return (
        Equation("B", vector("B", 18), REST_STRAINS.symbol + STRAIN_SHAPES.symbol * ETA.symbol),
        Equation("rate of B", vector("Bd", 18), STRAIN_SHAPES.symbol * ETAD.symbol),
        define("C1", -bracket(b[0], b[1])),
        define("C1d", -bracket(bd[0], b[1]) - bracket(b[0], bd[1])),
        define("C1dd", -2 * bracket(bd[0], bd[1])),
        define("W", 2 * b[2] + c1),
        define("Wd", 2 * bd[2] + c1d),
        define("C2", bracket(b[0], w) / 60),
        define("C2d", (bracket(bd[0], w) + bracket(b[0], wd)) / 60),
        define("C2dd", (2 * bracket(bd[0], wd) + bracket(b[0], c1dd)) / 60),
        define("X", -20 * b[0] - b[2] + c1),
        define("Xd", -20 * bd[0] - bd[2] + c1d),
        define("Y", b[1] + c2),
        define("Yd", bd[1] + c2d),
    )


def _column_equations() -> tuple[Equation, ...]:
    """Derivatives of C1, C2, X and Omega by the strain coordinates."""
    shapes = [STRAIN_SHAPES.symbol[6 * k : 6 * k + 6, :] for k in range(3)]
    b1, b2 = (part(vector("B", 18), 6 * k, 6) for k in range(2))
    w, x, y = (part(vector(name, 6), 0, 6) for name in "WXY")
    dc1, dc2, dx = FIRST_BRACKETS.symbol, SECOND_BRACKETS.symbol, FIRST_SUM.symbol
    return (
        Equation("dC1", dc1, bracket_columns(b2, shapes[0]) - bracket_columns(b1, shapes[1])),
        Equation(
            "dC2",
            dc2,
            (bracket_columns(b1, 2 * shapes[2], dc1) - bracket_columns(w, shapes[0])) / 60,
        ),
        Equation("dX", dx, dc1 - 20 * shapes[0] - shapes[2]),
        Equation(
            "dOmega / deta",
            JACOBIAN.symbol,
            shapes[0]
            + shapes[2] / 12
            - bracket_columns(x, shapes[1], dc2) / 240
            + bracket_columns(y, dx) / 240,
        ),
    )


def segment() -> Derivation:
    """Omega of a segment, its rates, and its derivatives by the strain coordinates."""
    b, bd = ([part(vector(name, 18), 6 * k, 6) for k in (0, 2)] for name in ("B", "Bd"))
    (_, _, c1dd), _, (_, _, c2dd), (x, xd, _), (y, yd, _) = map(_vectors, _POLYNOMIALS)
    return Derivation(
        "modal",
        "segment of an exact beam",
        (REST_STRAINS, STRAIN_SHAPES, ETA, ETAD),
        (FIRST_BRACKETS, SECOND_BRACKETS, FIRST_SUM, JACOBIAN, POSE, POSE_RATE, POSE_BIAS),
        (
            *_bracket_equations(),
            *_column_equations(),
            Equation("Omega", POSE.symbol, Matrix(b[0] + b[1] / 12 - bracket(x, y) / 240)),
            Equation(
                "rate of Omega",
                POSE_RATE.symbol,
                Matrix(bd[0] + bd[1] / 12 - (bracket(xd, y) + bracket(x, yd)) / 240),
            ),
            Equation(
                "second rate of Omega",
                POSE_BIAS.symbol,
                Matrix(-(bracket(c1dd, y) + 2 * bracket(xd, yd) + bracket(x, c2dd)) / 240),
            ),
        ),
        sources=SOURCES,
    )


# --- motion ---------------------------------------------------------------------------------------

#: S_1 .. S_7 with S_k = sum_j (-s)^j / (2 j + k)!, so that a = S_1, b = S_2, c = S_3.
_SERIES = {k: vector(f"S_{k}", 1)[0, 0] for k in range(1, 8)}
#: a, b, c, b', c', b'', c'': derivatives by s.
_FUNCTIONS = vector("abc", 7)
#: Terms of S_6 and S_7, exact to rounding up to the largest rotation.
_TERM_COUNT = 8


def _coefficients() -> tuple[Equation, ...]:
    """s = o_w . o_w, its rate, and a, b, c, b', c', b'', c''.

    Only the last two series are summed: S_k = 1 / k! - s S_(k+2), 2 S_k' = k S_(k+2) - S_(k+1).
    """
    o_w, rate = part(POSE.symbol, 3), part(POSE_RATE.symbol, 3)
    s = SQUARE[0, 0]
    s1, s2, s3, s4, s5, s6, s7 = _SERIES.values()
    sums = {k: even_series(k, s, term_count=_TERM_COUNT) for k in (7, 6)}
    sums |= {k: 1 / sp.factorial(k) - s * _SERIES[k + 2] for k in (5, 4, 3, 2, 1)}
    derivatives = [
        s4 - s3 / 2,
        (3 * s5 - s4) / 2,
        (s4 - 5 * s5 + 8 * s6) / 4,
        (s5 - 7 * s6 + 15 * s7) / 4,
    ]
    return (
        Equation("s", SQUARE, Matrix([sum(x * x for x in o_w)])),
        Equation("rate of s", vector("sd", 1), Matrix([2 * sum(map(sp.Mul, o_w, rate))])),
        *(Equation(f"S_{k}", vector(f"S_{k}", 1), Matrix([value])) for k, value in sums.items()),
        Equation("a, b, c, b', c', b'', c''", _FUNCTIONS, Matrix([s1, s2, s3, *derivatives])),
    )


def _rotation_terms() -> tuple[Matrix, Matrix, Matrix]:
    """exp(o_w~), V(o_w) = 1 + b o_w~ + c o_w~ o_w~, T_w = V(-o_w)."""
    a, b, c = (_FUNCTIONS[k, 0] for k in range(3))
    turn = tilde(part(POSE.symbol, 3))
    square = turn * turn
    return (
        Matrix(sp.eye(3) + a * turn + b * square),
        Matrix(sp.eye(3) + b * turn + c * square),
        Matrix(sp.eye(3) - b * turn + c * square),
    )


def _tangent_block() -> Matrix:
    """Derivative of T_w along o_v, the upper right block of T."""
    b, c, db, dc = (_FUNCTIONS[k, 0] for k in (1, 2, 3, 4))
    o_v, o_w = part(POSE.symbol, 0), part(POSE.symbol, 3)
    shift, turn = tilde(o_v), tilde(o_w)
    along = 2 * sum(map(sp.Mul, o_v, o_w))
    return Matrix(
        -b * shift + c * (turn * shift + shift * turn) + along * (dc * turn * turn - db * turn)
    )


def _bias_equations() -> tuple[Equation, ...]:
    """Rate of the twist T Omegad at etadd = 0, by brackets with Omega.

    T y = y - c1 [x, y] + c2 [x, [x, y]] - ...; c1 = b - s b', c2 = c - s c', c3 = -b', c4 = -c'.
    """
    s, sd = SQUARE[0, 0], vector("sd", 1)[0, 0]
    b, c, db, dc, ddb, ddc = (_FUNCTIONS[k, 0] for k in range(1, 7))
    signed = (-(b - s * db), c - s * dc, db, -dc)
    rates = (sd * s * ddb, -sd * s * ddc, sd * ddb, -sd * ddc)
    x, xd, xdd = (part(q.symbol, 0, 6) for q in (POSE, POSE_RATE, POSE_BIAS))
    z = [xd, *(part(vector(f"z{k}", 6), 0, 6) for k in range(1, 5))]
    zd = [xdd, *(part(vector(f"z{k}d", 6), 0, 6) for k in range(1, 5))]
    equations = []
    for k in range(4):
        product = bracket(x, zd[k])
        if k:  # [xd, z_0] = [xd, xd] = 0
            product = Matrix(product + bracket(xd, z[k]))
        equations += [
            Equation(f"bracket {k + 1}", vector(f"z{k + 1}", 6), bracket(x, z[k])),
            Equation(f"rate of bracket {k + 1}", vector(f"z{k + 1}d", 6), product),
        ]
    rate = xdd
    for factor, factor_rate, value, value_rate in zip(signed, rates, z[1:], zd[1:], strict=True):
        rate += factor * value_rate + factor_rate * value
    return (*equations, Equation("rate of the twist", vector("twist_d", 6), Matrix(rate)))


def segment_motion() -> Derivation:
    """Motion from a station (inboard) to the next one or an end (outboard), as a hinge kernel."""
    rotation, place, h6, v, w, bias = (q.symbol for q in MOTION_OUTPUTS)
    end = END_ROTATION.symbol
    turned, shift, tangent = _rotation_terms()
    block = end.T * _tangent_block()
    station_twist, twist_rate = vector("twist", 6), part(vector("twist_d", 6), 0, 6)
    v_s, w_s = part(station_twist, 0), part(station_twist, 3)
    linear = Matrix(twist_rate[:3, :] + w_s.cross(v_s))
    return Derivation(
        "modal",
        "motion across a segment of an exact beam",
        (END_ROTATION, POSE, POSE_RATE, POSE_BIAS),
        MOTION_OUTPUTS,
        (
            *_coefficients(),
            Equation("rotation", rotation, turned * end),
            Equation("place", place, shift * part(POSE.symbol, 0)),
            Equation(
                "H6 = T(Omega), end axes",
                h6,
                sp.BlockMatrix([[end.T * tangent, block], [sp.zeros(3, 3), end.T * tangent]]),
            ),
            Equation(
                "twist, station axes",
                station_twist,
                sp.BlockMatrix([[tangent, _tangent_block()], [sp.zeros(3, 3), tangent]])
                * POSE_RATE.symbol,
            ),
            Equation("v", v, end.T * v_s),
            Equation("w", w, end.T * w_s),
            *_bias_equations(),
            Equation("bias", bias, stack(end.T * linear, end.T * twist_rate[3:, :])),
        ),
        sources=SOURCES,
    )


def rotation_guards() -> tuple[tuple[sp.Basic, int, str], ...]:
    """Guard of the rotation along a segment: range of the series."""
    text = f"a segment of an exact beam turns by more than {MAX_SECTION_ROTATION} rad"
    return ((SQUARE[0, 0] < MAX_SECTION_ROTATION**2, 1, text),)
