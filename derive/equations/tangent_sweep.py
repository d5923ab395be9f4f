"""Exact tangent of inverse dynamics, eliminated from the tips to the root.

Every hinge has unknowns x along which its coordinates, speeds and accelerations change together, as
in a step of an implicit method.  Outboard of a hinge the load f at P of a body changes by

    df = S z + e,      z = [dw; dwd; da],

the changes of angular velocity, of angular acceleration and of acceleration (including gravity) in
body axes.  These are nine numbers because the hinge axes rotate with the body: the three depend
differently on the inboard unknowns.  Position, attitude and velocity drop out, as all components
are in body axes.  Across a hinge

    z = Th z_I + B x,      f_I = X^T f,      dX^T f = X^T G x,      rows: H^T df + W x = r

(Th, X: motion and load carried across the hinge in its current position; B, G, W: their derivatives
along x, from the hinge's own differentiated kernel), so that with K = S B

    D = H^T K + W,      S_I += X^T (S - (K + G) D^-1 H^T S) Th,
                        e_I += X^T (e + (K + G) D^-1 (r - H^T e))

Where parts of the increments are known beforehand (stages of a method), b is the motion and g the
load that they cause at one hinge, z = Th z_I + b + B x, and w their contribution to its rows; with
S_c the matrix carried on in place of S,

    y = D^-1 (r - w - H^T e),   e_I += X^T (e + V y + S_c b + g),   x = y - D^-1 H^T S (Th z_I + b)

Modal coordinates are unknowns of the same kind, whose body adds a load K x and rows of its own.
Arrays with a column per unknown or per entry of z are stored with a row for each, because they are
computed one direction at a time.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve, tilde, vector
from ..definition.notation import column, part, stack, symbol
from .riccati_sweep import SHIFT, E, R

#: Number of unknowns of a hinge, or of a flexible body.
N = sp.Symbol("n", integer=True, positive=True)

SOURCES = (
    "Rui, Wang, Zhang, ch. 8, 8.13 (linearised discrete-time form)",
    "Featherstone, Rigid Body Dynamics Algorithms, ch. 7 (articulated-body elimination)",
)

PARENT_RATE = Quantity(vector("w_I", 3), "rad/s", "angular velocity of the parent, parent axes")
V_REL = Quantity(vector("v", 3), "m/s", "relative velocity of the hinge, body axes")
W_REL = Quantity(vector("w", 3), "rad/s", "relative angular velocity of the hinge, body axes")
Z_PARENT = Quantity(vector("z_I", 9), "", "change of the parent's motion, parent axes")
Z = Quantity(vector("z", 9), "", "change of the body's motion, own axes")
ROWS_S = Quantity(
    symbol("S", 9, 6), "", "change of the load by that of the motion, one row per entry"
)


def _spin_acceleration() -> sp.ImmutableDenseMatrix:
    """Acceleration of P by the parent's change of angular velocity: (w x r)~ + w~ r~."""
    w, r = column(PARENT_RATE.symbol), column(SHIFT.symbol)
    return sp.ImmutableDenseMatrix(tilde(tilde(w) * r) + tilde(w) * tilde(r))


def tangent_carry() -> Derivation:
    """S Th, and X^T S Th added to the parent's S."""
    s_th = Quantity(symbol("T", 9, 6), "", "S Th, one row per entry")
    parent = Quantity(symbol("S_I", 9, 6), "", "S of the parent", accumulate=True)
    s = ROWS_S.symbol.T
    turn, rate, linear = (s[:, 3 * k : 3 * k + 3] for k in range(3))
    t_turn, t_rate, t_linear = (symbol(f"T_{name}", 6, 3) for name in ("w", "wd", "a"))
    velocity, t_rotation = symbol("v_I", 3), symbol("T_turn", 3, 3)
    relative, lever = tilde(column(W_REL.symbol)), tilde(column(SHIFT.symbol))
    total, parent_force = symbol("T_all", 6, 9), symbol("push", 3, 9)
    moment = R.symbol * total[3:, :] + lever * parent_force
    return Derivation(
        "frames",
        "change of a load carried to the parent",
        (R, SHIFT, PARENT_RATE, V_REL, W_REL, ROWS_S),
        (s_th, parent),
        (
            Equation("relative velocity, parent axes", velocity, R.symbol * V_REL.symbol),
            Equation(
                "acceleration of P by the parent's change of angular velocity",
                t_rotation,
                _spin_acceleration() + 2 * tilde(column(velocity)),
            ),
            Equation("by acceleration", t_linear, linear * R.symbol.T),
            Equation("by angular acceleration", t_rate, rate * R.symbol.T - t_linear * lever),
            Equation(
                "by angular velocity",
                t_turn,
                (turn - rate * relative) * R.symbol.T - t_linear * t_rotation,
            ),
            Equation("S Th", total, sp.BlockMatrix([[t_turn, t_rate, t_linear]])),
            Equation("S Th, by rows", s_th.symbol, total.T),
            Equation("forces, parent axes", parent_force, R.symbol * total[:3, :]),
            Equation("X^T S Th", parent.symbol, sp.BlockMatrix([[parent_force.T, moment.T]])),
        ),
        sources=SOURCES,
    )


def outboard_motion() -> tuple[Equation, sp.BlockMatrix]:
    """Th z_I, and the equation that precedes it."""
    turn, rate, linear = (part(Z_PARENT.symbol, 3 * k) for k in range(3))
    lever = tilde(column(SHIFT.symbol))
    dw = symbol("dw", 3)
    relative, velocity = tilde(column(W_REL.symbol)), tilde(column(V_REL.symbol))
    acceleration = linear - lever * rate - _spin_acceleration() * turn
    return Equation("change of the angular velocity", dw, R.symbol.T * turn), stack(
        dw, R.symbol.T * rate - relative * dw, R.symbol.T * acceleration - 2 * (velocity * dw)
    )


def tangent_motion() -> Derivation:
    """Th z_I: change of the body's motion by that of its parent."""
    first, motion = outboard_motion()
    return Derivation(
        "frames",
        "change of a body's motion by that of its parent",
        (R, SHIFT, PARENT_RATE, V_REL, W_REL, Z_PARENT),
        (Z,),
        (first, Equation("Th z_I", Z.symbol, motion)),
        sources=SOURCES,
    )


# --- increments that are known ------------------------------------------------------------------

KNOWN_MOTION = Quantity(symbol("b", 9), "", "known change of motion")
KNOWN_LOAD = Quantity(
    symbol("e_b", 6), "N, N*m", "load due to known increments, without the unknowns"
)
_ROTATED_LOAD = Quantity(
    symbol("g", 6), "N, N*m", "change of the carried load due to known increments"
)


def tangent_known_load() -> Derivation:
    """S b, as it enters the rows of unknowns, and S b + g, as it is carried on.

    With S after elimination of the unknowns, the rows of the unknowns only need z + b in place
    of z (see `tangent_solution`).
    """
    load_rows = Quantity(symbol("e_S", 6), "N, N*m", "load due to the known motion")
    return Derivation(
        "frames",
        "load due to a known motion",
        (ROWS_S, KNOWN_MOTION, _ROTATED_LOAD),
        (load_rows, KNOWN_LOAD),
        (
            Equation("S b", load_rows.symbol, ROWS_S.symbol.T * KNOWN_MOTION.symbol),
            Equation("S b + g", KNOWN_LOAD.symbol, load_rows.symbol + _ROTATED_LOAD.symbol),
        ),
        sources=SOURCES,
    )


# --- any number of unknowns ---------------------------------------------------------------------


def _rows(name: str, width: int, meaning: str) -> Quantity:
    """Array with a row of `width` numbers per unknown."""
    return Quantity(sp.MatrixSymbol(name, N, width), "", meaning)


def _columns(name: str, meaning: str) -> Quantity:
    """Array with a row per entry of a motion or displacement, and a column per unknown."""
    return Quantity(sp.MatrixSymbol(name, 9, N), "", meaning)


def _square(name: str, meaning: str) -> Quantity:
    return Quantity(sp.MatrixSymbol(name, N, N), "", meaning)


H = Quantity(sp.MatrixSymbol("H", 6, N), "", "motion subspace of the unknowns")
B = _rows("B", 9, "motion along the unknowns")
G = _rows("G", 6, "change of the carried load")
W = _square("W", "derivatives of the rows, one row per direction")
D = _square("D", "rows by unknowns")
V = Quantity(sp.MatrixSymbol("V", 6, N), "", "K + G")
GAIN = _rows("gain", 9, "D^-1 times the rows by the motion")
SOLUTION = Quantity(sp.MatrixSymbol("y", N, 1), "", "D^-1 times the remainder of the rows")
RIGHT = _rows("right", 9, "rows by the motion")
OWN_K = _rows("K", 6, "own load along the unknowns")
OWN_ROWS = Quantity(sp.MatrixSymbol("Z_z", 9, N), "", "own rows by the motion, one row per entry")
OWN_D = _square("Z_x", "own rows by the unknowns, one row per direction")


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
    """Elimination of the unknowns of a flexible body."""
    without = Quantity(symbol("S_c", 9, 6), "", "S without the unknowns, one row per entry")
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
                "S - V D^-1 H^T S", without.symbol, ROWS_S.symbol - GAIN.symbol.T * V.symbol.T
            ),
        ),
        sources=SOURCES,
    )


def assemble_port() -> Derivation:
    """Contribution of the bodies outboard of a port to the unknowns of a flexible body."""
    s_th = Quantity(symbol("T", 9, 6), "", "S Th, one row per entry")
    load = Quantity(OWN_K.symbol, accumulate=True)
    rows = Quantity(OWN_ROWS.symbol, accumulate=True)
    by_unknowns = Quantity(OWN_D.symbol, accumulate=True)
    k = Quantity(sp.MatrixSymbol("K_x", 6, N), "", "S B")
    force, moment = symbol("force", 3, N), symbol("moment", 3, N)
    parent_force = R.symbol * force
    lever = tilde(column(SHIFT.symbol))
    parent_load = sp.BlockMatrix([[parent_force.T, (R.symbol * moment + lever * parent_force).T]])
    return Derivation(
        "tangent",
        "part outboard of a port, along the unknowns of its body",
        (R, SHIFT, H, B, G, W, ROWS_S, s_th),
        (k, load, rows, by_unknowns),
        (
            Equation("S B", k.symbol, ROWS_S.symbol.T * B.symbol.T),
            Equation("force of K + G", force, k.symbol[:3, :] + G.symbol[:, :3].T),
            Equation("moment of K + G", moment, k.symbol[3:, :] + G.symbol[:, 3:].T),
            Equation("X^T (K + G)", load.symbol, parent_load),
            Equation("H^T S Th", rows.symbol, s_th.symbol * H.symbol),
            Equation("H^T K + W", by_unknowns.symbol, k.symbol.T * H.symbol + W.symbol),
        ),
        sources=SOURCES,
    )


def carry_columns() -> Derivation:
    """Contribution of the stations outboard of a station: load and rows along the unknowns.

    The station moves by z = Th z_I + B x, so that rows Z z become Z Th z_I + Z B x.
    """
    outboard_load, outboard_rows = _rows("K_o", 6, "load"), _columns("Z_o", "rows by the motion")
    load = Quantity(OWN_K.symbol, accumulate=True)
    rows = Quantity(OWN_ROWS.symbol, accumulate=True)
    by_unknowns = Quantity(OWN_D.symbol, accumulate=True)
    k, z = outboard_load.symbol, outboard_rows.symbol
    force, lever = R.symbol * k[:, :3].T, tilde(column(SHIFT.symbol))
    relative, velocity = tilde(column(W_REL.symbol)), tilde(column(V_REL.symbol))
    turn, rate, linear = (z[3 * i : 3 * i + 3, :] for i in range(3))
    acceleration = R.symbol * linear
    carried_turn = (
        R.symbol * (turn + relative * rate + 2 * (velocity * linear))
        - _spin_acceleration().T * acceleration
    )
    return Derivation(
        "tangent",
        "outboard stations along the unknowns of their body",
        (R, SHIFT, PARENT_RATE, V_REL, W_REL, H, B, outboard_load, outboard_rows),
        (load, rows, by_unknowns),
        (
            Equation(
                "X^T K",
                load.symbol,
                sp.BlockMatrix([[force.T, (R.symbol * k[:, 3:].T + lever * force).T]]),
            ),
            Equation(
                "Th^T Z",
                rows.symbol,
                sp.BlockMatrix(
                    [[carried_turn], [R.symbol * rate + lever * acceleration], [acceleration]]
                ),
            ),
            Equation("K^T H + B Z", by_unknowns.symbol, k * H.symbol + B.symbol * z),
        ),
        sources=SOURCES,
    )


def outboard_rows() -> Derivation:
    """Rows of the stations outboard of a station by a known change of its motion or pose."""
    rows, change = _columns("Z_o", "rows of the outboard stations"), symbol("b", 9)
    load = Quantity(sp.MatrixSymbol("e_f", N, 1), "", "load of the rows", accumulate=True)
    return Derivation(
        "tangent",
        "rows of outboard stations by a known change",
        (rows, Quantity(change, "", "known change of motion or pose")),
        (load,),
        (Equation("Z^T b", load.symbol, rows.symbol.T * change),),
        sources=SOURCES,
    )


def column_load() -> Derivation:
    """One right-hand side: y = D^-1 (-e_f - H^T e), and the load e + V y."""
    load_rows = Quantity(sp.MatrixSymbol("e_f", N, 1), "", "load of the rows")
    right_side = Quantity(sp.MatrixSymbol("rest", N, 1), "", "the remainder of the rows")
    load = Quantity(symbol("e_c", 6), "N, N*m", "load without the unknowns")
    return Derivation(
        "tangent",
        "unknowns eliminated from a right-hand side",
        (H, V, D, E, load_rows),
        (right_side, SOLUTION, load),
        (
            Equation("-e_f - H^T e", right_side.symbol, -load_rows.symbol - H.symbol.T * E.symbol),
            Equation("D^-1 (-e_f - H^T e)", SOLUTION.symbol, Solve(D.symbol, right_side.symbol)),
            Equation("e + V y", load.symbol, E.symbol + V.symbol * SOLUTION.symbol),
        ),
        sources=SOURCES,
    )


def coordinate_increment() -> Derivation:
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
BASE_MOTION = Quantity(vector("z_c", 9), "", "change of motion without the unknowns' part")


def column_solution() -> Derivation:
    """x = y - D^-1 H^T S z, and the motion including that of the unknowns."""
    return Derivation(
        "tangent",
        "solution for a right-hand side",
        (B, GAIN, SOLUTION, BASE_MOTION),
        (UNKNOWNS, Z),
        (
            Equation("x", UNKNOWNS.symbol, SOLUTION.symbol - GAIN.symbol * BASE_MOTION.symbol),
            Equation("z + B x", Z.symbol, BASE_MOTION.symbol + B.symbol.T * UNKNOWNS.symbol),
        ),
        sources=SOURCES,
    )


def port_motion() -> Derivation:
    """Motion of a port that follows the unknowns of a flexible body."""
    return Derivation(
        "tangent",
        "change of motion with the unknowns' part",
        (B, UNKNOWNS, BASE_MOTION),
        (Z,),
        (Equation("z + B x", Z.symbol, BASE_MOTION.symbol + B.symbol.T * UNKNOWNS.symbol),),
        sources=SOURCES,
    )


def increment_matrix() -> Derivation:
    """Q = (sq 1 - kappa g_q)^-1 of a hinge whose rates depend on its coordinates."""
    slopes = _square("g_q", "derivatives of the rates by the coordinates, one row per direction")
    unit = _square("one", "unit matrix")
    scale = Quantity(vector("sq", 1), "1/s", "inverse time of the step")
    share = Quantity(vector("kappa", 1), "", "1 to include the derivatives of the rates")
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
