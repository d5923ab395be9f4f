"""Tangent across a hinge: its directions, and elimination of its unknowns.

Equations and names are those of `tangent_sweep`.  Changes across the hinge along a direction come
from the hinge's own differentiated kernel; a constant subspace determines them directly.  There is
a kernel for every number of free speeds.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, tilde, vector
from ..definition.notation import column, part, stack, symbol
from .riccati_sweep import PARENT_E, SHIFT, E, R, free_speeds, transport
from .tangent_sweep import (
    KNOWN_LOAD,
    KNOWN_MOTION,
    PARENT_RATE,
    ROWS_S,
    SOURCES,
    V_REL,
    W_REL,
    Z_PARENT,
    Z,
    outboard_motion,
)

ROTATION = Quantity(vector("theta", 3), "", "rotation of the body along the direction, body axes")
DISPLACEMENT = Quantity(vector("x", 3), "", "displacement of P along the direction, body axes")
_OF_Q = Quantity(vector("Q", 9), "", "motion of Q in body axes: w, wd, and a of its carrier at P")
_LOAD = Quantity(vector("f", 6), "N, N*m", "carried load at P")
_COLUMN = (
    Quantity(vector("B", 9), "", "motion along the direction"),
    Quantity(vector("G", 6), "", "change of the carried load"),
)


def tangent_pose_change() -> Derivation:
    """theta and R^T dd, theta~ = R^T dR."""
    r, d_r, d_d = symbol("R", 3, 3), symbol("d_R", 3, 3), symbol("d_d", 3)
    turn = sp.ImmutableDenseMatrix(
        [sum(r[k, i] * d_r[k, j] for k in range(3)) for i, j in ((2, 1), (0, 2), (1, 0))]
    )
    return Derivation(
        "frames",
        "rotation and displacement along a direction",
        tuple(map(Quantity, (r, d_r, d_d))),
        (ROTATION, DISPLACEMENT),
        (
            Equation("theta~ = R^T dR", ROTATION.symbol, turn),
            Equation("R^T dd", DISPLACEMENT.symbol, r.T * d_d),
        ),
        sources=SOURCES,
    )


def tangent_coordinate_change(nu: int) -> Derivation:
    """theta = H_w dq and R^T dd = H_v dq, for coordinate rates equal to the speeds."""
    h, d_q = symbol("H", 6, nu), symbol("d_q", nu)
    return Derivation(
        f"generic{nu}",
        f"rotation and displacement along coordinates of a hinge with {free_speeds(nu)}",
        (Quantity(h), Quantity(d_q)),
        (ROTATION, DISPLACEMENT),
        (
            Equation("theta = H_w dq", ROTATION.symbol, h[3:, :] * d_q),
            Equation("R^T dd = H_v dq", DISPLACEMENT.symbol, h[:3, :] * d_q),
        ),
        sources=SOURCES,
    )


def tangent_carrier(nu: int) -> Derivation:
    """Motion of Q from that of the body: w_Q = w - w_rel and so on."""
    h, s, v, w, c, motion = (symbol(name, *shape) for name, shape in (
        ("H", (6, nu)), ("s", (nu,)), ("v", (3,)), ("w", (3,)), ("c", (6,)), ("motion", (9,))
    ))  # fmt: skip
    turning, rate, acceleration, bias = (symbol(name, rows) for name, rows in (
        ("w_Q", 3), ("wd_Q", 3), ("a_Q", 3), ("c_s", 6)
    ))  # fmt: skip
    spin = tilde(column(turning))
    return Derivation(
        f"generic{nu}",
        f"motion of Q across a hinge with {nu} speeds",
        tuple(map(Quantity, (h, s, v, w, c, motion))),
        (_OF_Q,),
        (
            Equation("angular velocity of Q", turning, part(motion, 0) - column(w)),
            Equation("own acceleration", bias, c + h * s if nu else c),
            Equation(
                "angular acceleration of Q",
                rate,
                part(motion, 3) - spin * column(w) - part(bias, 3),
            ),
            Equation(
                "acceleration of the point of Q's carrier at P",
                acceleration,
                part(motion, 6) - 2 * spin * column(v) - part(bias, 0),
            ),
            Equation("all of it", _OF_Q.symbol, stack(turning, rate, acceleration)),
        ),
        sources=SOURCES,
    )


_ZERO_COLUMN = sp.ImmutableDenseMatrix(sp.zeros(3, 1))


def _direction_equations(
    v: sp.MatrixBase,
    w: sp.MatrixSymbol,
    d_v: sp.MatrixBase,
    d_w: sp.Basic,
    d_c: tuple[sp.Basic, sp.Basic],
    displacement: sp.MatrixBase | None = None,
) -> tuple[Equation, ...]:
    """B and G from the changes across the hinge."""
    turn = tilde(column(ROTATION.symbol))
    displacement = column(DISPLACEMENT.symbol) if displacement is None else displacement
    turning, rate, acceleration = (part(_OF_Q.symbol, 3 * k) for k in range(3))
    d_turning = symbol("dw_Q", 3)
    relative, spin = tilde(column(w)), tilde(turning)
    force, moment = part(_LOAD.symbol, 0), part(_LOAD.symbol, 3)
    b, g = (quantity.symbol for quantity in _COLUMN)
    return (
        Equation("derivative of w_Q", d_turning, -turn * turning),
        Equation(
            "B",
            b,
            stack(
                d_w + d_turning,
                d_c[1] - turn * rate - relative * d_turning + spin * d_w,
                d_c[0]
                - turn * acceleration
                + tilde(rate) * displacement
                + spin * (spin * displacement)
                + 2 * (spin * d_v - tilde(v) * d_turning),
            ),
        ),
        Equation("G", g, stack(turn * force, turn * moment + tilde(displacement) * force)),
    )


def _row_derivative(
    nu: int, load_part: sp.Basic | None
) -> tuple[tuple[Quantity, ...], Quantity, Equation]:
    """Derivatives of a hinge's rows by load, rotors and laws: inputs, output, equation."""
    rotor, d_s, laws, row = (symbol(name, nu) for name in ("J", "d_s", "laws", "row"))
    rotors = sp.ImmutableDenseMatrix(nu, 1, lambda k, _: rotor[k, 0] * d_s[k, 0])
    return (
        (
            Quantity(rotor, "kg*m2 or kg", "rotor inertia reflected to the speeds"),
            Quantity(laws, "", "change of the laws' efforts"),
        ),
        Quantity(row, "", "change of the rows by load, rotors and laws"),
        Equation(
            "change of the rows", row, (rotors if load_part is None else load_part + rotors) - laws
        ),
    )


def tangent_column(nu: int) -> Derivation:
    """B, G and the load part of W along one direction of a hinge, body axes.

    With theta the turn of the body along the direction, x its change of place R^T dd and the motion
    of Q in body axes (`tangent_carrier`):

        B = [dw_rel - theta~ w_Q;
             dc_w - theta~ wd_Q - (theta~ w_Q) x w_rel + w_Q x dw_rel;
             dc_v - theta~ a_Q + (wd_Q~ + w_Q~ w_Q~) x - 2 (theta~ w_Q) x v + 2 w_Q x dv]
        G = [theta~ f; theta~ m + x x f],      dH^T [f; m] + J ds - dtau in the rows
    """
    h, s, d_h, d_s = (symbol(n, *shape) for n, shape in (
        ("H", (6, nu)), ("s", (nu,)), ("d_H", (6, nu)), ("d_s", (nu,))
    ))  # fmt: skip
    v, w, d_v, d_w, d_c = (symbol(n, rows) for n, rows in (
        ("v", 3), ("w", 3), ("d_v", 3), ("d_w", 3), ("d_c", 6)
    ))  # fmt: skip
    d_bias = symbol("dc_s", 6)
    row_inputs, row, rows = _row_derivative(nu, d_h.T * _LOAD.symbol)
    equations = (
        Equation(
            "derivative of the own acceleration", d_bias, d_c + d_h * s + h * d_s if nu else d_c
        ),
        *_direction_equations(
            column(v), w, column(d_v), column(d_w), (part(d_bias, 0), part(d_bias, 3))
        ),
    )
    return Derivation(
        f"generic{nu}",
        f"a direction of a hinge with {nu} speeds",
        (ROTATION, DISPLACEMENT, *map(Quantity, (h, s, v, w)), _OF_Q, _LOAD,
         *map(Quantity, (d_h, d_v, d_w, d_c, d_s)), *row_inputs),
        (*_COLUMN, row),
        (*equations, rows) if nu else equations,
        sources=SOURCES,
    )  # fmt: skip


def tangent_steady(nu: int) -> Derivation:
    """`tangent_column` of a hinge with constant H: c = [w x v; 0]."""
    h, v, w = symbol("H", 6, nu), symbol("v", 3), symbol("w", 3)
    d_u, d_s = symbol("d_u", nu), symbol("d_s", nu)
    d_v, d_w, d_bias = symbol("d_v", 3), symbol("d_w", 3), symbol("dc_s", 6)
    row_inputs, row, rows = _row_derivative(nu, None)
    own_acceleration = symbol("own", 6)
    linear_part = tilde(column(d_w)) * column(v) + tilde(column(w)) * column(d_v)
    return Derivation(
        f"generic{nu}",
        f"a direction of a hinge with {free_speeds(nu)}, whose subspace is constant",
        (ROTATION, DISPLACEMENT, *map(Quantity, (h, v, w)), _OF_Q, _LOAD,
         *map(Quantity, (d_u, d_s)), *row_inputs),
        (*_COLUMN, row),
        (
            Equation("derivative of v", d_v, h[:3, :] * d_u),
            Equation("derivative of w", d_w, h[3:, :] * d_u),
            Equation("H ds", own_acceleration, h * d_s),
            Equation(
                "derivative of the own acceleration", d_bias,
                stack(part(own_acceleration, 0) + linear_part, part(own_acceleration, 3)),
            ),
            *_direction_equations(
                column(v), w, column(d_v), column(d_w), (part(d_bias, 0), part(d_bias, 3))
            ),
            rows,
        ),
        sources=SOURCES,
    )  # fmt: skip


def tangent_rotational(nu: int) -> Derivation:
    """`tangent_steady` of a hinge that only rotates: v, H_v and displacement are zero."""
    h, w, d_u, d_s = symbol("H", 6, nu), symbol("w", 3), symbol("d_u", nu), symbol("d_s", nu)
    d_w, own_acceleration = symbol("d_w", 3), symbol("own", 3)
    row_inputs, row, rows = _row_derivative(nu, None)
    return Derivation(
        f"generic{nu}",
        f"a direction of a hinge with {free_speeds(nu)}, which rotates about constant axes",
        (ROTATION, *map(Quantity, (h, w)), _OF_Q, _LOAD, *map(Quantity, (d_u, d_s)), *row_inputs),
        (*_COLUMN, row),
        (
            Equation("derivative of w", d_w, h[3:, :] * d_u),
            Equation("H_w ds", own_acceleration, h[3:, :] * d_s),
            *_direction_equations(
                _ZERO_COLUMN,
                w,
                _ZERO_COLUMN,
                column(d_w),
                (_ZERO_COLUMN, column(own_acceleration)),
                _ZERO_COLUMN,
            ),
            rows,
        ),
        sources=SOURCES,
    )


# --- the unknowns of a hinge --------------------------------------------------------------------


def _hinge_quantities(nu: int) -> dict[str, Quantity]:
    """Stored quantities of a hinge with `nu` free speeds; arrays with a row for each."""
    sizes = {
        "H": (6, nu, "motion subspace of the unknowns"),
        "B": (nu, 9, "motion along the unknowns"),
        "G": (nu, 6, "change of the carried load"),
        "W": (nu, nu, "derivatives of the rows, one row per direction"),
        "K": (nu, 6, "S B, one row per direction"),
        "V": (nu, 6, "K + G, one row per direction"),
        "D": (nu, nu, "rows by unknowns"),
        "right": (nu, 9, "rows by the motion"),
        "gain": (nu, 9, "D^-1 times the rows by the motion"),
        "inverse": (nu, nu, "D^-1"),
        "y": (nu, 1, "D^-1 times the remainder of the rows"),
    }
    return {
        name: Quantity(symbol(name, rows, columns), "", meaning)
        for name, (rows, columns, meaning) in sizes.items()
    }


def tangent_rows(nu: int) -> Derivation:
    """D = H^T S B + W of a hinge, and its rows by the motion."""
    at = _hinge_quantities(nu)
    h, b, w, k, d, right = (at[name] for name in ("H", "B", "W", "K", "D", "right"))
    unit = Quantity(symbol("one", nu, nu), "", "unit matrix")
    s = ROWS_S.symbol
    return Derivation(
        f"generic{nu}",
        f"rows of a hinge with {free_speeds(nu)}",
        (h, b, w, ROWS_S),
        (k, right, d, unit),
        (
            Equation("K = S B", k.symbol, b.symbol * s),
            Equation("H^T S", right.symbol, h.symbol.T * s.T),
            Equation("D = H^T K + W", d.symbol, h.symbol.T * k.symbol.T + w.symbol.T),
            Equation("1", unit.symbol, sp.ImmutableDenseMatrix(sp.eye(nu))),
        ),
        sources=SOURCES,
    )


def tangent_reduce(nu: int) -> Derivation:
    """S after elimination of the unknowns of a hinge."""
    at = _hinge_quantities(nu)
    inverse, right, k, g, v, gain = (
        at[name] for name in ("inverse", "right", "K", "G", "V", "gain")
    )
    change = Quantity(ROWS_S.symbol, "", ROWS_S.meaning, accumulate=True)
    return Derivation(
        f"generic{nu}",
        f"S without the unknowns of a hinge with {free_speeds(nu)}",
        (inverse, right, k, g),
        (gain, v, change),
        (
            Equation("D^-1 H^T S", gain.symbol, inverse.symbol * right.symbol),
            Equation("V = K + G", v.symbol, k.symbol + g.symbol),
            Equation("- V D^-1 H^T S", change.symbol, -gain.symbol.T * v.symbol),
        ),
        sources=SOURCES,
    )


def tangent_load(nu: int, known: bool = False) -> Derivation:
    """y = D^-1 (-e_f - H^T e), and the load e + V y carried to the parent.

    With `known`, the load of known increments is added.
    """
    at = _hinge_quantities(nu)
    h, v, inverse, y = (at[name] for name in ("H", "V", "inverse", "y"))
    load_rows = Quantity(symbol("e_f", nu), "", "load of the rows")
    onward = symbol("e_c", 6)
    carried = E.symbol + v.symbol.T * y.symbol
    return Derivation(
        f"generic{nu}",
        f"a right-hand side carried across a hinge with {free_speeds(nu)}"
        + (" and known increments" if known else ""),
        (R, SHIFT, h, v, inverse, E, load_rows, *((KNOWN_LOAD,) if known else ())),
        (y, PARENT_E),
        (
            Equation(
                "D^-1 (-e_f - H^T e)",
                y.symbol,
                inverse.symbol * (-load_rows.symbol - h.symbol.T * E.symbol),
            ),
            Equation("e + V y", onward, carried + KNOWN_LOAD.symbol if known else carried),
            Equation("X^T (e + V y)", PARENT_E.symbol, transport(onward)),
        ),
        sources=SOURCES,
    )


def tangent_load_with_increments(nu: int) -> Derivation:
    """`tangent_load` with known increments of the hinge."""
    return tangent_load(nu, known=True)


def tangent_solution(nu: int, known: bool = False) -> Derivation:
    """x = y - D^-1 H^T S z of a hinge, z = Th z_I, and the motion z + B x of the body.

    With `known`, the known motion is added to z.
    """
    at = _hinge_quantities(nu)
    b, gain, y = (at[name] for name in ("B", "gain", "y"))
    unknowns = Quantity(symbol("x", nu), "", "unknowns")
    motion = symbol("z_c", 9)
    first, carried = outboard_motion()
    return Derivation(
        f"generic{nu}",
        f"solution of a hinge with {free_speeds(nu)} for a right-hand side"
        + (" and known increments" if known else ""),
        (
            R,
            SHIFT,
            PARENT_RATE,
            V_REL,
            W_REL,
            Z_PARENT,
            b,
            gain,
            y,
            *((KNOWN_MOTION,) if known else ()),
        ),
        (unknowns, Z),
        (
            first,
            Equation("Th z_I", motion, carried + KNOWN_MOTION.symbol if known else carried),
            Equation("x", unknowns.symbol, y.symbol - gain.symbol * motion),
            Equation("z", Z.symbol, motion + b.symbol.T * unknowns.symbol),
        ),
        sources=SOURCES,
    )


def tangent_solution_with_increments(nu: int) -> Derivation:
    """`tangent_solution` with known increments of the hinge."""
    return tangent_solution(nu, known=True)
