"""The exact tangent of inverse dynamics, eliminated from the tips to the root.

Let every hinge have unknowns x along which its coordinates, speeds and accelerations change
together, as a step of an implicit method wants it.  Behind a hinge the load f at P of a body
changes by

    df = S z + e,      z = [dw; dwd; da],

the changes of angular velocity, of angular acceleration and of acceleration (gravity inside it) in
body axes.  Nine numbers, for the hinge axes turn with the body: the three are different images of
the unknowns inboard.  Position, attitude and velocity drop out, all components being those of the
body.  Across a hinge

    z = Th z_I + B x,      f_I = X^T f,      dX^T f = X^T G x,      rows: H^T df + W x = r

(Th, X: motion and load carried by the hinge as it stands; B, G, W: their slopes along x, which come
from the hinge's own kernel differentiated), so that with K = S B

    D = H^T K + W,      S_I += X^T (S - (K + G) D^-1 H^T S) Th,
                        e_I += X^T (e + (K + G) D^-1 (r - H^T e))

Where parts of the increments are known beforehand (stages of a method), b is the motion and g the
load that they make of one hinge, z = Th z_I + b + B x, and w what they make of its rows; with S_c
what is carried on in place of S,

    y = D^-1 (r - w - H^T e),   e_I += X^T (e + V y + S_c b + g),   x = y - D^-1 H^T S (Th z_I + b)

Modal coordinates are unknowns of the same kind, whose body adds a load K x of its own and rows of
its own.  Arrays with a column per unknown or per entry of z are kept with a row for each, as they
are made one direction at a time.
"""

from __future__ import annotations

import sympy as sp

from ..language.derivation import Derivation, Equation, Quantity, Solve, tilde, vector
from .algebra import column, part, stack, symbol
from .sweep import PARENT_E, SHIFT, E, R, free_speeds, transport

#: Number of unknowns of a hinge, or of a flexible body.
N = sp.Symbol("n", integer=True, positive=True)

SOURCES = (
    "Rui, Wang, Zhang, ch. 8, 8.13 (linearised discrete-time form)",
    "Featherstone, Rigid Body Dynamics Algorithms, ch. 7 (articulated-body elimination)",
)

TURN_PARENT = Quantity(vector("w_I", 3), "rad/s", "angular velocity of the parent, parent axes")
V_REL = Quantity(vector("v", 3), "m/s", "relative velocity of the hinge, body axes")
W_REL = Quantity(vector("w", 3), "rad/s", "relative angular velocity of the hinge, body axes")
Z_PARENT = Quantity(vector("z_I", 9), "", "change of the parent's motion, parent axes")
Z = Quantity(vector("z", 9), "", "change of the body's motion, own axes")
ROWS_S = Quantity(symbol("S", 9, 6), "", "change of the load by that of the motion, a row an entry")


def _spun() -> sp.ImmutableDenseMatrix:
    """Acceleration of P by the parent's change of angular velocity: (w x r)~ + w~ r~."""
    w, r = column(TURN_PARENT.symbol), column(SHIFT.symbol)
    return sp.ImmutableDenseMatrix(tilde(tilde(w) * r) + tilde(w) * tilde(r))


def tangent_carry() -> Derivation:
    """S Th, and X^T S Th added to the parent's S."""
    along = Quantity(symbol("T", 9, 6), "", "S Th, a row an entry")
    parent = Quantity(symbol("S_I", 9, 6), "", "that of the parent", accumulate=True)
    s = ROWS_S.symbol.T
    turn, rate, linear = (s[:, 3 * k : 3 * k + 3] for k in range(3))
    t_turn, t_rate, t_linear = (symbol(f"T_{name}", 6, 3) for name in ("w", "wd", "a"))
    velocity, turned = symbol("v_I", 3), symbol("T_turn", 3, 3)
    relative, lever = tilde(column(W_REL.symbol)), tilde(column(SHIFT.symbol))
    whole, pushed = symbol("T_all", 6, 9), symbol("push", 3, 9)
    moment = R.symbol * whole[3:, :] + lever * pushed
    return Derivation(
        "frames",
        "change of a load carried to the parent",
        (R, SHIFT, TURN_PARENT, V_REL, W_REL, ROWS_S),
        (along, parent),
        (
            Equation("relative velocity, parent axes", velocity, R.symbol * V_REL.symbol),
            Equation(
                "acceleration of P by the parent's change of angular velocity",
                turned,
                _spun() + 2 * tilde(column(velocity)),
            ),
            Equation("by acceleration", t_linear, linear * R.symbol.T),
            Equation("by angular acceleration", t_rate, rate * R.symbol.T - t_linear * lever),
            Equation(
                "by angular velocity",
                t_turn,
                (turn - rate * relative) * R.symbol.T - t_linear * turned,
            ),
            Equation("S Th", whole, sp.BlockMatrix([[t_turn, t_rate, t_linear]])),
            Equation("S Th, by rows", along.symbol, whole.T),
            Equation("forces, parent axes", pushed, R.symbol * whole[:3, :]),
            Equation("X^T S Th", parent.symbol, sp.BlockMatrix([[pushed.T, moment.T]])),
        ),
        sources=SOURCES,
    )


def _behind() -> tuple[Equation, sp.BlockMatrix]:
    """Th z_I, and the equation that it needs before."""
    turn, rate, linear = (part(Z_PARENT.symbol, 3 * k) for k in range(3))
    lever = tilde(column(SHIFT.symbol))
    seen = symbol("dw", 3)
    relative, velocity = tilde(column(W_REL.symbol)), tilde(column(V_REL.symbol))
    moved = linear - lever * rate - _spun() * turn
    return Equation("change of the angular velocity", seen, R.symbol.T * turn), stack(
        seen,
        R.symbol.T * rate - relative * seen,
        R.symbol.T * moved - 2 * (velocity * seen),
    )


def tangent_moved() -> Derivation:
    """Th z_I: change of the body's motion by that of its parent's alone."""
    first, moved = _behind()
    return Derivation(
        "frames",
        "change of a body's motion by that of its parent's",
        (R, SHIFT, TURN_PARENT, V_REL, W_REL, Z_PARENT),
        (Z,),
        (first, Equation("Th z_I", Z.symbol, moved)),
        sources=SOURCES,
    )


# --- increments that are known ------------------------------------------------------------------

KNOWN = Quantity(symbol("b", 9), "", "change of motion that is known")
KNOWN_LOAD = Quantity(symbol("e_b", 6), "N, N*m", "load by what is known, without the unknowns")
_TURNED_LOAD = Quantity(symbol("g", 6), "N, N*m", "change of the carried load by what is known")


def tangent_known() -> Derivation:
    """S b, as rows of unknowns see it, and S b + g, as it is carried on.

    With S as it is without the unknowns, the rows of the unknowns themselves need no more than
    z + b in place of z (see `tangent_answer`)."""
    felt = Quantity(symbol("e_S", 6), "N, N*m", "load by the motion that is known")
    return Derivation(
        "frames",
        "load by a motion that is known",
        (ROWS_S, KNOWN, _TURNED_LOAD),
        (felt, KNOWN_LOAD),
        (
            Equation("S b", felt.symbol, ROWS_S.symbol.T * KNOWN.symbol),
            Equation("S b + g", KNOWN_LOAD.symbol, felt.symbol + _TURNED_LOAD.symbol),
        ),
        sources=SOURCES,
    )


# --- along one direction of a hinge -------------------------------------------------------------

TURN = Quantity(vector("theta", 3), "", "turn of the body along the direction, body axes")
PLACE = Quantity(vector("x", 3), "", "change of place of P along the direction, body axes")
_OF_Q = Quantity(vector("Q", 9), "", "motion of Q in body axes: w, wd, and a of its carrier at P")
_LOAD = Quantity(vector("f", 6), "N, N*m", "load at P that is carried")
_COLUMN = (
    Quantity(vector("B", 9), "", "motion along the direction"),
    Quantity(vector("G", 6), "", "change of the load that is carried"),
)


def tangent_turned() -> Derivation:
    """theta and R^T dd, theta~ = R^T dR."""
    r, d_r, d_d = symbol("R", 3, 3), symbol("d_R", 3, 3), symbol("d_d", 3)
    turn = sp.ImmutableDenseMatrix(
        [sum(r[k, i] * d_r[k, j] for k in range(3)) for i, j in ((2, 1), (0, 2), (1, 0))]
    )
    return Derivation(
        "frames",
        "turn and change of place along a direction",
        tuple(map(Quantity, (r, d_r, d_d))),
        (TURN, PLACE),
        (
            Equation("theta~ = R^T dR", TURN.symbol, turn),
            Equation("R^T dd", PLACE.symbol, r.T * d_d),
        ),
        sources=SOURCES,
    )


def tangent_along(nu: int) -> Derivation:
    """theta = H_w dq and R^T dd = H_v dq where the rates of the coordinates are the speeds."""
    h, d_q = symbol("H", 6, nu), symbol("d_q", nu)
    return Derivation(
        f"generic{nu}",
        f"turn and change of place along coordinates of a hinge with {free_speeds(nu)}",
        (Quantity(h), Quantity(d_q)),
        (TURN, PLACE),
        (
            Equation("theta = H_w dq", TURN.symbol, h[3:, :] * d_q),
            Equation("R^T dd = H_v dq", PLACE.symbol, h[:3, :] * d_q),
        ),
        sources=SOURCES,
    )


def tangent_carrier(nu: int) -> Derivation:
    """w_Q = w - w_rel and so on: what the body's own motion gives back of that of Q."""
    h, s, v, w, c, motion = (symbol(name, *shape) for name, shape in (
        ("H", (6, nu)), ("s", (nu,)), ("v", (3,)), ("w", (3,)), ("c", (6,)), ("motion", (9,))
    ))  # fmt: skip
    turning, rate, seen, bias = (symbol(name, rows) for name, rows in (
        ("w_Q", 3), ("wd_Q", 3), ("a_Q", 3), ("c_s", 6)
    ))  # fmt: skip
    own = tilde(column(turning))
    return Derivation(
        f"generic{nu}",
        f"motion of Q across a hinge with {nu} speeds",
        tuple(map(Quantity, (h, s, v, w, c, motion))),
        (_OF_Q,),
        (
            Equation("angular velocity of Q", turning, part(motion, 0) - column(w)),
            Equation("own acceleration", bias, c + h * s if nu else c),
            Equation(
                "angular acceleration of Q", rate, part(motion, 3) - own * column(w) - part(bias, 3)
            ),
            Equation(
                "acceleration of the point of Q's carrier at P",
                seen,
                part(motion, 6) - 2 * own * column(v) - part(bias, 0),
            ),
            Equation("all of it", _OF_Q.symbol, stack(turning, rate, seen)),
        ),
        sources=SOURCES,
    )


def _along(
    v: sp.MatrixSymbol, w: sp.MatrixSymbol, d_v: sp.Basic, d_w: sp.Basic, d_c: sp.MatrixSymbol
) -> tuple[Equation, ...]:
    """B and G by the changes of what is across the hinge."""
    turn, place = tilde(column(TURN.symbol)), column(PLACE.symbol)
    turning, rate, seen = (part(_OF_Q.symbol, 3 * k) for k in range(3))
    d_turning = symbol("dw_Q", 3)
    relative, own = tilde(column(w)), tilde(turning)
    force, moment = part(_LOAD.symbol, 0), part(_LOAD.symbol, 3)
    b, g = (quantity.symbol for quantity in _COLUMN)
    return (
        Equation("slope of w_Q", d_turning, -turn * turning),
        Equation(
            "B",
            b,
            stack(
                d_w + d_turning,
                part(d_c, 3) - turn * rate - relative * d_turning + own * d_w,
                part(d_c, 0)
                - turn * seen
                + tilde(rate) * place
                + own * (own * place)
                + 2 * (own * d_v - tilde(column(v)) * d_turning),
            ),
        ),
        Equation("G", g, stack(turn * force, turn * moment + tilde(place) * force)),
    )


def _row(nu: int, own: sp.Basic | None) -> tuple[tuple[Quantity, ...], Quantity, Equation]:
    """Slopes of a hinge's rows by load, rotors and laws: further inputs, output, equation."""
    rotor, d_s, laws, row = (symbol(name, nu) for name in ("J", "d_s", "laws", "row"))
    rotors = sp.ImmutableDenseMatrix(nu, 1, lambda k, _: rotor[k, 0] * d_s[k, 0])
    return (
        (
            Quantity(rotor, "kg*m2 or kg", "rotor inertia reflected to the speeds"),
            Quantity(laws, "", "change of the laws' efforts"),
        ),
        Quantity(row, "", "change of the rows by load, rotors and laws"),
        Equation("change of the rows", row, (rotors if own is None else own + rotors) - laws),
    )


def tangent_column(nu: int) -> Derivation:
    """B, G and the load's share of W along one direction of a hinge, seen in body axes.

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
    more, row, rows = _row(nu, d_h.T * _LOAD.symbol)
    equations = (
        Equation("slope of the own acceleration", d_bias, d_c + d_h * s + h * d_s if nu else d_c),
        *_along(v, w, column(d_v), column(d_w), d_bias),
    )
    return Derivation(
        f"generic{nu}",
        f"a direction of a hinge with {nu} speeds",
        (TURN, PLACE, *map(Quantity, (h, s, v, w)), _OF_Q, _LOAD,
         *map(Quantity, (d_h, d_v, d_w, d_c, d_s)), *more),
        (*_COLUMN, row),
        (*equations, rows) if nu else equations,
        sources=SOURCES,
    )  # fmt: skip


def tangent_steady(nu: int) -> Derivation:
    """`tangent_column` of a hinge whose H is the same in every position: c = [w x v; 0]."""
    h, v, w = symbol("H", 6, nu), symbol("v", 3), symbol("w", 3)
    d_u, d_s = symbol("d_u", nu), symbol("d_s", nu)
    d_v, d_w, d_bias = symbol("d_v", 3), symbol("d_w", 3), symbol("dc_s", 6)
    more, row, rows = _row(nu, None)
    own = symbol("own", 6)
    turned = tilde(column(d_w)) * column(v) + tilde(column(w)) * column(d_v)
    return Derivation(
        f"generic{nu}",
        f"a direction of a hinge with {free_speeds(nu)}, whose subspace is constant",
        (TURN, PLACE, *map(Quantity, (h, v, w)), _OF_Q, _LOAD,
         *map(Quantity, (d_u, d_s)), *more),
        (*_COLUMN, row),
        (
            Equation("slope of v", d_v, h[:3, :] * d_u),
            Equation("slope of w", d_w, h[3:, :] * d_u),
            Equation("H ds", own, h * d_s),
            Equation(
                "slope of the own acceleration", d_bias, stack(part(own, 0) + turned, part(own, 3))
            ),
            *_along(v, w, column(d_v), column(d_w), d_bias),
            rows,
        ),
        sources=SOURCES,
    )  # fmt: skip


# --- the unknowns of a hinge --------------------------------------------------------------------


def _hinge(nu: int) -> dict[str, Quantity]:
    """What is kept of a hinge with `nu` free speeds; arrays with a row for each."""
    sizes = {
        "H": (6, nu, "motion subspace of the unknowns"),
        "B": (nu, 9, "motion along the unknowns"),
        "G": (nu, 6, "change of the load that is carried"),
        "W": (nu, nu, "slopes of the rows, a row a direction"),
        "K": (nu, 6, "S B, a row a direction"),
        "V": (nu, 6, "K + G, a row a direction"),
        "D": (nu, nu, "rows by unknowns"),
        "right": (nu, 9, "rows by the motion"),
        "gain": (nu, 9, "D^-1 times the rows by the motion"),
        "inverse": (nu, nu, "D^-1"),
        "y": (nu, 1, "D^-1 times what is left of the rows"),
    }
    return {
        name: Quantity(symbol(name, rows, columns), "", meaning)
        for name, (rows, columns, meaning) in sizes.items()
    }


def tangent_rows(nu: int) -> Derivation:
    """D = H^T S B + W of a hinge, and its rows by the motion."""
    at = _hinge(nu)
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
    """S without the unknowns of a hinge."""
    at = _hinge(nu)
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


def tangent_push(nu: int, known: bool = False) -> Derivation:
    """y = D^-1 (-e_f - H^T e), and the load e + V y (+ what is `known`) carried to the parent."""
    at = _hinge(nu)
    h, v, inverse, y = (at[name] for name in ("H", "V", "inverse", "y"))
    own = Quantity(symbol("e_f", nu), "", "load of the rows")
    onward = symbol("e_c", 6)
    carried = E.symbol + v.symbol.T * y.symbol
    return Derivation(
        f"generic{nu}",
        f"a right-hand side carried across a hinge with {free_speeds(nu)}"
        + (" and increments that are known" if known else ""),
        (R, SHIFT, h, v, inverse, E, own, *((KNOWN_LOAD,) if known else ())),
        (y, PARENT_E),
        (
            Equation(
                "D^-1 (-e_f - H^T e)",
                y.symbol,
                inverse.symbol * (-own.symbol - h.symbol.T * E.symbol),
            ),
            Equation("e + V y", onward, carried + KNOWN_LOAD.symbol if known else carried),
            Equation("X^T (e + V y)", PARENT_E.symbol, transport(onward)),
        ),
        sources=SOURCES,
    )


def tangent_push_known(nu: int) -> Derivation:
    """`tangent_push` where increments of the hinge are known."""
    return tangent_push(nu, known=True)


def tangent_answer(nu: int, known: bool = False) -> Derivation:
    """x = y - D^-1 H^T S z of a hinge, z = Th z_I (+ what is `known`), and z + B x behind it."""
    at = _hinge(nu)
    b, gain, y = (at[name] for name in ("B", "gain", "y"))
    unknowns = Quantity(symbol("x", nu), "", "unknowns")
    moved = symbol("z_c", 9)
    first, behind = _behind()
    return Derivation(
        f"generic{nu}",
        f"unknowns of a hinge with {free_speeds(nu)} that answer a right-hand side"
        + (" and increments that are known" if known else ""),
        (R, SHIFT, TURN_PARENT, V_REL, W_REL, Z_PARENT, b, gain, y, *((KNOWN,) if known else ())),
        (unknowns, Z),
        (
            first,
            Equation("Th z_I", moved, behind + KNOWN.symbol if known else behind),
            Equation("x", unknowns.symbol, y.symbol - gain.symbol * moved),
            Equation("z", Z.symbol, moved + b.symbol.T * unknowns.symbol),
        ),
        sources=SOURCES,
    )


def tangent_answer_known(nu: int) -> Derivation:
    """`tangent_answer` where increments of the hinge are known."""
    return tangent_answer(nu, known=True)


# --- any number of unknowns ---------------------------------------------------------------------


def _rows(name: str, width: int, meaning: str) -> Quantity:
    """A row of `width` numbers per unknown."""
    return Quantity(sp.MatrixSymbol(name, N, width), "", meaning)


def _square(name: str, meaning: str) -> Quantity:
    return Quantity(sp.MatrixSymbol(name, N, N), "", meaning)


H = Quantity(sp.MatrixSymbol("H", 6, N), "", "motion subspace of the unknowns")
B = _rows("B", 9, "motion along the unknowns")
G = _rows("G", 6, "change of the load that is carried")
W = _square("W", "slopes of the rows, a row a direction")
D = _square("D", "rows by unknowns")
V = Quantity(sp.MatrixSymbol("V", 6, N), "", "K + G")
GAIN = _rows("gain", 9, "D^-1 times the rows by the motion")
ANSWER = Quantity(sp.MatrixSymbol("y", N, 1), "", "D^-1 times what is left of the rows")
RIGHT = _rows("right", 9, "rows by the motion")
OWN_K = _rows("K", 6, "own load along the unknowns")
OWN_ROWS = Quantity(sp.MatrixSymbol("Z_z", 9, N), "", "own rows by the motion, a row an entry")
OWN_D = _square("Z_x", "own rows by the unknowns, a row a direction")


def invert() -> Derivation:
    """D^-1 of the rows of a hinge."""
    unit, inverse = _square("one", "unit matrix"), _square("inverse", "D^-1")
    return Derivation(
        "tangent",
        "inverse of the rows by the unknowns of a hinge",
        (D, unit),
        (inverse,),
        (Equation("D^-1", inverse.symbol, Solve(D.symbol, unit.symbol)),),
    )


def node() -> Derivation:
    """The unknowns of a flexible body eliminated."""
    without = Quantity(symbol("S_c", 9, 6), "", "S without the unknowns, a row an entry")
    s = ROWS_S.symbol.T
    k = symbol("K_x", 6, N)
    return Derivation(
        "tangent",
        "unknowns of a flexible body eliminated",
        (H, B, G, W, ROWS_S, OWN_K, OWN_ROWS, OWN_D),
        (V, D, RIGHT, GAIN, without),
        (
            Equation("K = S B + K", k, s * B.symbol.T + OWN_K.symbol.T),
            Equation("V = K + G", V.symbol, k + G.symbol.T),
            Equation(
                "D = H^T K + W",
                D.symbol,
                H.symbol.T * k + W.symbol.T + OWN_ROWS.symbol.T * B.symbol.T + OWN_D.symbol.T,
            ),
            Equation("H^T S", RIGHT.symbol, H.symbol.T * s + OWN_ROWS.symbol.T),
            Equation("D^-1 H^T S", GAIN.symbol, Solve(D.symbol, RIGHT.symbol)),
            Equation(
                "S - V D^-1 H^T S",
                without.symbol,
                ROWS_S.symbol - GAIN.symbol.T * V.symbol.T,
            ),
        ),
        sources=SOURCES,
    )


def absorb() -> Derivation:
    """What hangs on a port of a flexible body, as its unknowns see it."""
    along = Quantity(symbol("T", 9, 6), "", "S Th, a row an entry")
    load = Quantity(OWN_K.symbol, accumulate=True)
    rows = Quantity(OWN_ROWS.symbol, accumulate=True)
    by_unknowns = Quantity(OWN_D.symbol, accumulate=True)
    k = Quantity(sp.MatrixSymbol("K_x", 6, N), "", "S B")
    force, moment = symbol("force", 3, N), symbol("moment", 3, N)
    pushed = R.symbol * force
    lever = tilde(column(SHIFT.symbol))
    felt = sp.BlockMatrix([[pushed.T, (R.symbol * moment + lever * pushed).T]])
    return Derivation(
        "tangent",
        "what hangs on a port, as the unknowns of its body see it",
        (R, SHIFT, H, B, G, W, ROWS_S, along),
        (k, load, rows, by_unknowns),
        (
            Equation("S B", k.symbol, ROWS_S.symbol.T * B.symbol.T),
            Equation("force of K + G", force, k.symbol[:3, :] + G.symbol[:, :3].T),
            Equation("moment of K + G", moment, k.symbol[3:, :] + G.symbol[:, 3:].T),
            Equation("X^T (K + G)", load.symbol, felt),
            Equation("H^T S Th", rows.symbol, along.symbol * H.symbol),
            Equation("H^T K + W", by_unknowns.symbol, k.symbol.T * H.symbol + W.symbol),
        ),
        sources=SOURCES,
    )


def push() -> Derivation:
    """One right-hand side: y = D^-1 (-e_f - H^T e), and the load e + V y."""
    own = Quantity(sp.MatrixSymbol("e_f", N, 1), "", "load of the rows")
    rest = Quantity(sp.MatrixSymbol("rest", N, 1), "", "what is left of the rows")
    load = Quantity(symbol("e_c", 6), "N, N*m", "load without the unknowns")
    return Derivation(
        "tangent",
        "unknowns eliminated from a right-hand side",
        (H, V, D, E, own),
        (rest, ANSWER, load),
        (
            Equation("-e_f - H^T e", rest.symbol, -own.symbol - H.symbol.T * E.symbol),
            Equation("D^-1 (-e_f - H^T e)", ANSWER.symbol, Solve(D.symbol, rest.symbol)),
            Equation("e + V y", load.symbol, E.symbol + V.symbol * ANSWER.symbol),
        ),
        sources=SOURCES,
    )


def lagged() -> Derivation:
    """dq = Q times the change of the rates."""
    inverse = _square("Q", "(sq 1 - kappa g_q)^-1")
    rate = Quantity(sp.MatrixSymbol("rate", N, 1), "", "change of the rates at given coordinates")
    change = Quantity(sp.MatrixSymbol("dq", N, 1), "", "change of the coordinates")
    return Derivation(
        "tangent",
        "change of coordinates",
        (inverse, rate),
        (change,),
        (Equation("dq", change.symbol, inverse.symbol * rate.symbol),),
    )


UNKNOWNS = Quantity(sp.MatrixSymbol("x", N, 1), "", "unknowns")
BEHIND = Quantity(vector("z_c", 9), "", "change of motion without the unknowns' part")


def answer() -> Derivation:
    """x = y - D^-1 H^T S z, and the motion with the unknowns' part."""
    return Derivation(
        "tangent",
        "unknowns that answer a right-hand side",
        (B, GAIN, ANSWER, BEHIND),
        (UNKNOWNS, Z),
        (
            Equation("x", UNKNOWNS.symbol, ANSWER.symbol - GAIN.symbol * BEHIND.symbol),
            Equation("z + B x", Z.symbol, BEHIND.symbol + B.symbol.T * UNKNOWNS.symbol),
        ),
        sources=SOURCES,
    )


def displaced() -> Derivation:
    """Motion of what follows the unknowns of a flexible body."""
    return Derivation(
        "tangent",
        "change of motion with the unknowns' part",
        (B, UNKNOWNS, BEHIND),
        (Z,),
        (Equation("z + B x", Z.symbol, BEHIND.symbol + B.symbol.T * UNKNOWNS.symbol),),
        sources=SOURCES,
    )


def lag() -> Derivation:
    """Q = (sq 1 - kappa g_q)^-1 of a hinge whose rates depend on its coordinates: dq = Q (...)."""
    slopes = _square("g_q", "slopes of the rates by the coordinates, a row a direction")
    unit = _square("one", "unit matrix")
    scale = Quantity(vector("sq", 1), "1/s", "inverse time of the step")
    share = Quantity(vector("kappa", 1), "", "1 where the rates' own slopes count")
    matrix, out = _square("A", "sq 1 - kappa g_q"), _square("Q", "its inverse")
    return Derivation(
        "tangent",
        "change of coordinates by that of their rates",
        (scale, share, unit, slopes),
        (matrix, out),
        (
            Equation(
                "sq 1 - kappa g_q",
                matrix.symbol,
                scale.symbol[0, 0] * unit.symbol - share.symbol[0, 0] * slopes.symbol.T,
            ),
            Equation("its inverse", out.symbol, Solve(matrix.symbol, unit.symbol)),
        ),
    )
