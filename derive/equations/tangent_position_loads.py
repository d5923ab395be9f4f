"""Tangent of position-dependent loads: nine more components of motion.

Loads in inertial axes, force elements to the ground and drag depend on position and velocity of
their body.  Outboard of the hinges that lead to them the load then changes by

    df = S z + S_p p + e,      p = [psi; r; v],

the rotation of the body, the displacement of its P and the change of its velocity, in body axes, in
addition to z of `tangent_sweep`.  Across a hinge, with theta and x the rotation and the
displacement along an unknown,

    p = Th_p p_I + Th_z z_I + B_p x,    Th_p p_I + Th_z z_I = [R^T psi;  R^T (r - r~ psi);
                                                                R^T (v - r~ dw)],
    B_p = [theta;  x;  dv_rel - theta~ (v - v_rel) + w_Q~ x]

so that the elimination of `tangent_sweep` has further columns of the same kind:

    K = S B + S_p B_p,    S_p,I += X^T (S_p - V D^-1 H^T S_p) Th_p,    S_I += X^T (...) Th_z,
    x = y - D^-1 H^T (S z + S_p p)

The kernels here complement those of `tangent_sweep` and `tangent_hinge_elimination`: for a hinge,
S_p B_p is added to G and H^T S_p B_p to W beforehand, for a flexible body to its own load and rows.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve, tilde, vector
from ..definition.notation import column, part, stack, symbol
from .riccati_sweep import SHIFT, R
from .tangent_hinge_elimination import DISPLACEMENT, ROTATION
from .tangent_sweep import OWN_D, OWN_K, OWN_ROWS, SOLUTION, SOURCES, V_REL, Z_PARENT, D, H, N, V

P = Quantity(vector("p", 9), "", "change of pose: rotation, position and velocity of P, own axes")
_P_PARENT = Quantity(vector("p_I", 9), "", "change of the parent's pose, parent axes")
_ROWS_S = Quantity(symbol("S_p", 9, 6), "", "change of the load by the pose, one row per entry")
_B = Quantity(sp.MatrixSymbol("B_p", N, 9), "", "change of pose along the unknowns")
_GAIN = Quantity(sp.MatrixSymbol("gain", N, 9), "", "D^-1 times the rows by the pose")
_OWN_ROWS = Quantity(sp.MatrixSymbol("Z_p", 9, N), "", "own rows by the pose, one row per entry")


def _carried_displacement() -> sp.BlockMatrix:
    """Th_p p_I + Th_z z_I."""
    turn, position, velocity = (part(_P_PARENT.symbol, 3 * k) for k in range(3))
    lever, spin = tilde(column(SHIFT.symbol)), part(Z_PARENT.symbol, 0)
    return stack(
        R.symbol.T * turn,
        R.symbol.T * (position - lever * turn),
        R.symbol.T * (velocity - lever * spin),
    )


def placed_displacement() -> Derivation:
    """p of the outboard body from the motion of the parent."""
    return Derivation(
        "frames",
        "change of a body's pose by the motion of its parent",
        (R, SHIFT, Z_PARENT, _P_PARENT),
        (P,),
        (Equation("Th_p p_I + Th_z z_I", P.symbol, _carried_displacement()),),
        sources=SOURCES,
    )


def placed_pose() -> Derivation:
    """Changes of axes, position and velocity of a body by its displacement."""
    axes = Quantity(symbol("A", 3, 3), "", "axes, body to inertial")
    d_axes = Quantity(symbol("d_A", 3, 3), "", "their change")
    d_place = Quantity(vector("d_x", 3), "m", "displacement of P, inertial axes")
    d_velocity = Quantity(vector("d_v", 3), "m/s", "change of velocity of P, own axes")
    turn, position, velocity = (part(P.symbol, 3 * k) for k in range(3))
    return Derivation(
        "frames",
        "pose and velocity by a change of pose",
        (axes, P),
        (d_axes, d_place, d_velocity),
        (
            Equation("A psi~", d_axes.symbol, axes.symbol * tilde(turn)),
            Equation("A r", d_place.symbol, axes.symbol * position),
            Equation("v", d_velocity.symbol, velocity),
        ),
        sources=SOURCES,
    )


def placed_column() -> Derivation:
    """B_p along one direction of a hinge or of a section."""
    velocity = Quantity(vector("v_P", 3), "m/s", "velocity of P, own axes")
    d_v = Quantity(vector("d_v", 3), "m/s", "change of the relative velocity")
    of_q = Quantity(vector("Q", 9), "", "motion of Q in body axes: w first")
    turn, position = column(ROTATION.symbol), column(DISPLACEMENT.symbol)
    carried = sp.ImmutableDenseMatrix(column(velocity.symbol) - column(V_REL.symbol))
    velocity_change = (
        column(d_v.symbol) - tilde(turn) * carried + tilde(part(of_q.symbol, 0)) * position
    )
    return Derivation(
        "frames",
        "change of pose along a direction",
        (ROTATION, DISPLACEMENT, velocity, V_REL, d_v, of_q),
        (Quantity(symbol("B_p", 9), "", "change of pose along the direction"),),
        (Equation("B_p", symbol("B_p", 9), stack(turn, position, velocity_change)),),
        sources=SOURCES,
    )


def placed_carry() -> Derivation:
    """S_p Th_p and S_p Th_z, and both carried by X^T to the parent."""
    s_th = Quantity(symbol("T_p", 9, 6), "", "S_p Th_p, one row per entry")
    by_spin = Quantity(symbol("T_w", 3, 6), "", "S_p Th_z by angular velocity", accumulate=True)
    to_place = Quantity(symbol("S_pI", 9, 6), "", "S_p of the parent", accumulate=True)
    to_spin = Quantity(
        symbol("S_wI", 3, 6), "", "S of the parent, by angular velocity", accumulate=True
    )
    s = _ROWS_S.symbol.T
    turn, position, velocity = (s[:, 3 * k : 3 * k + 3] for k in range(3))
    t_turn, t_place, t_velocity, t_spin = (
        symbol(f"T_{name}", 6, 3) for name in ("psi", "r", "v", "dw")
    )
    lever = tilde(column(SHIFT.symbol))
    total, parent_force = symbol("T_all", 6, 12), symbol("push", 3, 12)
    carried = symbol("carried", 6, 12)
    moment = R.symbol * total[3:, :] + lever * parent_force
    return Derivation(
        "frames",
        "change of a load by the pose, carried to the parent",
        (R, SHIFT, _ROWS_S),
        (s_th, by_spin, to_place, to_spin),
        (
            Equation("by place", t_place, position * R.symbol.T),
            Equation("by turn", t_turn, turn * R.symbol.T - t_place * lever),
            Equation("by velocity", t_velocity, velocity * R.symbol.T),
            Equation("by angular velocity", t_spin, -(t_velocity * lever)),
            Equation(
                "S_p [Th_p, Th_z]", total, sp.BlockMatrix([[t_turn, t_place, t_velocity, t_spin]])
            ),
            Equation("S_p Th_p, by rows", s_th.symbol, total[:, :9].T),
            Equation("S_p Th_z, by rows", by_spin.symbol, total[:, 9:].T),
            Equation("forces, parent axes", parent_force, R.symbol * total[:3, :]),
            Equation("X^T S_p [Th_p, Th_z]", carried, sp.BlockMatrix([[parent_force], [moment]])),
            Equation("X^T S_p Th_p", to_place.symbol, carried[:, :9].T),
            Equation("X^T S_p Th_z", to_spin.symbol, carried[:, 9:].T),
        ),
        sources=SOURCES,
    )


def placed_known_load() -> Derivation:
    """Contribution of a known displacement to `tangent_known_load`."""
    displacement = Quantity(symbol("b_p", 9), "", "known change of pose")
    load_rows = Quantity(
        symbol("e_S", 6), "N, N*m", "load due to known increments", accumulate=True
    )
    carried = Quantity(
        symbol("e_b", 6), "N, N*m", "carried load due to known increments", accumulate=True
    )
    load = symbol("e_p", 6)
    return Derivation(
        "frames",
        "load due to a known change of pose",
        (_ROWS_S, displacement),
        (load_rows, carried),
        (
            Equation("S_p b_p", load, _ROWS_S.symbol.T * displacement.symbol),
            Equation("to the load along the unknowns", load_rows.symbol, load),
            Equation("to the carried load", carried.symbol, load),
        ),
        sources=SOURCES,
    )


# --- any number of unknowns ---------------------------------------------------------------------


def placed_rows() -> Derivation:
    """Rows of a hinge by displacement."""
    rows = Quantity(_OWN_ROWS.symbol, "", "rows by the pose, one row per entry")
    return Derivation(
        "tangent",
        "rows of a hinge by the change of pose",
        (H, _ROWS_S),
        (rows,),
        (Equation("S_p^T H", rows.symbol, _ROWS_S.symbol * H.symbol),),
        sources=SOURCES,
    )


def placed_own() -> Derivation:
    """Contribution of the displacement along the unknowns to load and rows."""
    load = Quantity(OWN_K.symbol, accumulate=True)
    rows = Quantity(OWN_D.symbol, accumulate=True)
    return Derivation(
        "tangent",
        "load and rows along the unknowns by the change of pose",
        (_B, _ROWS_S, _OWN_ROWS),
        (load, rows),
        (
            Equation("S_p B_p", load.symbol, _B.symbol * _ROWS_S.symbol),
            Equation("Z_p B_p", rows.symbol, _B.symbol * _OWN_ROWS.symbol),
        ),
        sources=SOURCES,
    )


def placed_reduce() -> Derivation:
    """S_p after elimination of the unknowns of a hinge."""
    inverse = Quantity(sp.MatrixSymbol("inverse", N, N), "", "D^-1")
    v = Quantity(sp.MatrixSymbol("V", N, 6), "", "K + G, one row per direction")
    change = Quantity(_ROWS_S.symbol, "", _ROWS_S.meaning, accumulate=True)
    return Derivation(
        "tangent",
        "unknowns of a hinge eliminated from loads by the pose",
        (inverse, _OWN_ROWS, v),
        (_GAIN, change),
        (
            Equation("D^-1 H^T S_p", _GAIN.symbol, inverse.symbol * _OWN_ROWS.symbol.T),
            Equation("- V D^-1 H^T S_p", change.symbol, -_GAIN.symbol.T * v.symbol),
        ),
        sources=SOURCES,
    )


def placed_node() -> Derivation:
    """S_p after elimination of the unknowns of a flexible body."""
    right = Quantity(sp.MatrixSymbol("right", N, 9), "", "rows by the pose")
    without = Quantity(symbol("S_c", 9, 6), "", "S_p without the unknowns, one row per entry")
    return Derivation(
        "tangent",
        "unknowns of a flexible body eliminated from loads by the pose",
        (H, V, D, _ROWS_S, _OWN_ROWS),
        (right, _GAIN, without),
        (
            Equation("H^T S_p", right.symbol, H.symbol.T * _ROWS_S.symbol.T + _OWN_ROWS.symbol.T),
            Equation("D^-1 H^T S_p", _GAIN.symbol, Solve(D.symbol, right.symbol)),
            Equation(
                "S_p - V D^-1 H^T S_p", without.symbol, _ROWS_S.symbol - _GAIN.symbol.T * V.symbol.T
            ),
        ),
        sources=SOURCES,
    )


def placed_port() -> Derivation:
    """`assemble_port` for position-dependent loads outboard of a port of a flexible body."""
    s_th = Quantity(symbol("T_p", 9, 6), "", "S_p Th_p, one row per entry")
    load = Quantity(OWN_K.symbol, accumulate=True)
    rows = Quantity(_OWN_ROWS.symbol, accumulate=True)
    by_unknowns = Quantity(OWN_D.symbol, accumulate=True)
    k = sp.MatrixSymbol("K_x", 6, N)
    parent_force = sp.MatrixSymbol("force", 3, N)
    lever = tilde(column(SHIFT.symbol))
    parent_load = sp.BlockMatrix([[parent_force.T, (R.symbol * k[3:, :] + lever * parent_force).T]])
    return Derivation(
        "tangent",
        "loads by the pose of the part outboard of a port, along the unknowns of its body",
        (R, SHIFT, H, _B, _ROWS_S, s_th),
        (load, rows, by_unknowns),
        (
            Equation("S_p B_p", k, _ROWS_S.symbol.T * _B.symbol.T),
            Equation("force of S_p B_p", parent_force, R.symbol * k[:3, :]),
            Equation("X^T S_p B_p", load.symbol, parent_load),
            Equation("H^T S_p Th_p", rows.symbol, s_th.symbol * H.symbol),
            Equation("H^T S_p B_p", by_unknowns.symbol, k.T * H.symbol),
        ),
        sources=SOURCES,
    )


def placed_carry_columns() -> Derivation:
    """`tangent_sweep.carry_columns` for rows by the pose p = Th_p p_I + Th_z z_I + B_p x."""
    outboard = Quantity(sp.MatrixSymbol("Z_o", 9, N), "", "rows by the pose, one row per entry")
    rows = Quantity(_OWN_ROWS.symbol, accumulate=True)
    by_motion = Quantity(OWN_ROWS.symbol, accumulate=True)
    by_unknowns = Quantity(OWN_D.symbol, accumulate=True)
    turn, position, velocity = (R.symbol * outboard.symbol[3 * i : 3 * i + 3, :] for i in range(3))
    lever = tilde(column(SHIFT.symbol))
    return Derivation(
        "tangent",
        "outboard stations by the pose, along the unknowns of their body",
        (R, SHIFT, _B, outboard),
        (rows, by_motion, by_unknowns),
        (
            Equation(
                "Th_p^T Z",
                rows.symbol,
                sp.BlockMatrix([[turn + lever * position], [position], [velocity]]),
            ),
            Equation(
                "Th_z^T Z",
                by_motion.symbol,
                sp.BlockMatrix([[lever * velocity], [sp.ZeroMatrix(3, N)], [sp.ZeroMatrix(3, N)]]),
            ),
            Equation("B_p Z", by_unknowns.symbol, _B.symbol * outboard.symbol),
        ),
        sources=SOURCES,
    )


def placed_remainder() -> Derivation:
    """y less the contribution of the displacement to the rows."""
    result = Quantity(SOLUTION.symbol, "", "the remainder of the rows", accumulate=True)
    return Derivation(
        "tangent",
        "rows less their change by the change of pose",
        (_GAIN, P),
        (result,),
        (Equation("- D^-1 H^T S_p p", result.symbol, -(_GAIN.symbol * P.symbol)),),
        sources=SOURCES,
    )
