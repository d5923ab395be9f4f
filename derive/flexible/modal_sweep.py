"""Steps of the Riccati sweep across a flexible body: add ports, re-base, condense, recover.

The load f on the frame, the frame's acceleration deviation a and the modal accelerations etadd
satisfy

    [f; tau] = [S  S_rf; S_rf^T  S_ff] [a; etadd] + [e; e_f]

A port moves with a_O = X a + H etadd and adds f_O = S_O a_O + e_O.  If the frame is not that of the
supported section, a = a_I + H_I etadd (re-base).  Then the modes are eliminated.
"""

from __future__ import annotations

import sympy as sp

from ..definition.derivation import Derivation, Equation, Quantity, Solve, tilde, vector
from ..definition.notation import part, stack
from ..equations.riccati_sweep import DELTA, SHIFT, SOURCES, E, R, S
from .modal_residual import (
    DAMPING,
    E_F,
    ETA,
    ETAD,
    S_FF,
    S_RF,
    STIFFNESS,
    N,
    modal_columns,
    modal_vector,
)

MODAL_SUBSPACE = modal_columns("H", 6, "motion subspace of the modes, rows v then w, outboard axes")
WORK = modal_columns("U", 6, "S H")
MODAL_ACCELERATIONS = modal_vector("etadd", "modal accelerations")
MODAL_EFFORTS = modal_vector("tau", "efforts on the modes")
REBASED_COLUMNS = modal_columns("S_rf_I", 6, "S_rf + S H")
MODAL_GAIN = Quantity(sp.MatrixSymbol("Gg", N, 7), "", "etadd = g - G a: columns of G, then -g")


def _accumulating(quantity: Quantity) -> Quantity:
    """Same array as an output that is added to."""
    return Quantity(quantity.symbol, quantity.unit, quantity.meaning, accumulate=True)


def assemble_port() -> Derivation:
    """Modal rows of the bodies outboard of a port; its frame rows are carried as by a weld."""
    force, moment = WORK.symbol[:3, :], WORK.symbol[3:, :]
    return Derivation(
        "modal",
        "S and e of a port along the modes",
        (R, SHIFT, MODAL_SUBSPACE, S, E),
        (WORK, _accumulating(S_RF), _accumulating(S_FF), _accumulating(E_F)),
        (
            Equation("U = S H", WORK.symbol, S.symbol * MODAL_SUBSPACE.symbol),
            Equation("X^T U", S_RF.symbol, _columns_at_frame(force, moment)),
            Equation("H^T U", S_FF.symbol, MODAL_SUBSPACE.symbol.T * WORK.symbol),
            Equation("H^T e", E_F.symbol, MODAL_SUBSPACE.symbol.T * E.symbol),
        ),
        sources=SOURCES,
    )


def rebase() -> Derivation:
    """Modal rows and columns for the frame acceleration a_I + H etadd."""
    rebased, coupling = REBASED_COLUMNS, S_RF.symbol
    return Derivation(
        "modal",
        "frame relative to the supported section",
        (MODAL_SUBSPACE, S, E, S_RF),
        (rebased, _accumulating(S_FF), _accumulating(E_F)),
        (
            Equation("S_rf + S H", rebased.symbol, coupling + S.symbol * MODAL_SUBSPACE.symbol),
            Equation(
                "H^T S_rf_I + S_rf^T H", S_FF.symbol,
                MODAL_SUBSPACE.symbol.T * rebased.symbol + coupling.T * MODAL_SUBSPACE.symbol,
            ),
            Equation("H^T e", E_F.symbol, MODAL_SUBSPACE.symbol.T * E.symbol),
        ),
        sources=SOURCES,
    )  # fmt: skip


def carry_columns() -> Derivation:
    """Frame rows of the modes at a station, carried to the previous station: X^T S_rf."""
    force, moment = REBASED_COLUMNS.symbol[:3, :], REBASED_COLUMNS.symbol[3:, :]
    return Derivation(
        "modal",
        "columns of the modes carried along a segment",
        (R, SHIFT, REBASED_COLUMNS),
        (_accumulating(S_RF),),
        (Equation("X^T S_rf", S_RF.symbol, _columns_at_frame(force, moment)),),
        sources=SOURCES,
    )


def _columns_at_frame(force: sp.Basic, moment: sp.Basic) -> sp.BlockMatrix:
    """Columns of forces and moments at a port, in the axes and about the origin of the frame."""
    lever = tilde(part(SHIFT.symbol, 0))
    rotated_force = R.symbol * force
    return stack(rotated_force, R.symbol * moment + lever * rotated_force)


def condense() -> Derivation:
    """Modes eliminated: S - S_rf S_ff^-1 S_fr and e - S_rf S_ff^-1 e_f (efforts are in e_f)."""
    right = Quantity(sp.MatrixSymbol("right", N, 7), "", "S_fr, e_f")
    condensed = Quantity(sp.MatrixSymbol("S_c", 6, 6), "", "S without modes", symmetric=True)
    load = Quantity(vector("e_c", 6), "N, N*m", "e without modes")
    right_sides = sp.BlockMatrix([[S_RF.symbol.T, E_F.symbol]])
    gain = MODAL_GAIN.symbol
    return Derivation(
        "modal",
        "modes of a flexible body condensed",
        (S, E, S_RF, S_FF, E_F),
        (right, MODAL_GAIN, condensed, load),
        (
            Equation("[S_fr, e_f]", right.symbol, right_sides),
            Equation("S_ff^-1 [S_fr, e_f]", gain, Solve(S_FF.symbol, right.symbol, True)),
            Equation("S_c", condensed.symbol, S.symbol - S_RF.symbol * gain[:, :6], symmetric=True),
            Equation("e_c", load.symbol, E.symbol - S_RF.symbol * gain[:, 6:]),
        ),
        sources=SOURCES,
    )


FRAME_DEVIATION = Quantity(
    vector("delta_I", 6), "", "deviation of the frame without the modes' part"
)


def recover() -> Derivation:
    """Modal accelerations from the deviation of the frame."""
    gain = MODAL_GAIN.symbol
    return Derivation(
        "modal",
        "modal accelerations recovered",
        (MODAL_GAIN, FRAME_DEVIATION),
        (MODAL_ACCELERATIONS,),
        (
            Equation(
                "etadd = g - G a",
                MODAL_ACCELERATIONS.symbol,
                -gain[:, 6:] - gain[:, :6] * FRAME_DEVIATION.symbol,
            ),
        ),
        sources=SOURCES,
    )


def port_deviation() -> Derivation:
    """Deviation of a port that follows the modes: a + H etadd."""
    return Derivation(
        "modal",
        "deviation with the modes' part",
        (MODAL_SUBSPACE, MODAL_ACCELERATIONS, FRAME_DEVIATION),
        (DELTA,),
        (
            Equation(
                "a + H etadd",
                DELTA.symbol,
                FRAME_DEVIATION.symbol + MODAL_SUBSPACE.symbol * MODAL_ACCELERATIONS.symbol,
            ),
        ),
        sources=SOURCES,
    )


def prescribed_load() -> Derivation:
    """Loads of prescribed modal accelerations s."""
    s = modal_vector("s", "prescribed modal accelerations")
    accumulated_load = Quantity(E.symbol, E.unit, E.meaning, accumulate=True)
    return Derivation(
        "modal",
        "loads of prescribed modal accelerations",
        (S_RF, S_FF, s),
        (accumulated_load, _accumulating(E_F)),
        (
            Equation("S_rf s", E.symbol, S_RF.symbol * s.symbol),
            Equation("S_ff s", E_F.symbol, S_FF.symbol * s.symbol),
        ),
        sources=SOURCES,
    )


def outboard_load() -> Derivation:
    """Load on a station by the modal accelerations of the stations outboard of it."""
    load = Quantity(E.symbol, E.unit, E.meaning, accumulate=True)
    return Derivation(
        "modal",
        "load of the outboard stations by modal accelerations",
        (S_RF, MODAL_ACCELERATIONS),
        (load,),
        (Equation("S_rf etadd", E.symbol, S_RF.symbol * MODAL_ACCELERATIONS.symbol),),
        sources=SOURCES,
    )


def modal_effort() -> Derivation:
    """Required efforts on the modes: e_f + H^T e."""
    return Derivation(
        "modal",
        "efforts on the modes",
        (MODAL_SUBSPACE, E, E_F),
        (MODAL_EFFORTS,),
        (
            Equation(
                "e_f + H^T e", MODAL_EFFORTS.symbol, E_F.symbol + MODAL_SUBSPACE.symbol.T * E.symbol
            ),
        ),
        sources=SOURCES,
    )


def column_load() -> Derivation:
    """Load e - G^T e_f of a flexible body after elimination of its modes, with S condensed."""
    load = Quantity(vector("e_c", 6), "N, N*m", "e without modes")
    gain = MODAL_GAIN.symbol[:, :6]
    return Derivation(
        "modal",
        "load of a flexible body condensed",
        (MODAL_GAIN, E, E_F),
        (load,),
        (Equation("e - G^T e_f", load.symbol, E.symbol - gain.T * E_F.symbol),),
        sources=SOURCES,
    )


def column_acceleration() -> Derivation:
    """Modal accelerations due to a load on the modes and the deviation of the frame."""
    response = modal_vector("y", "S_ff^-1 e_f")
    gain = MODAL_GAIN.symbol[:, :6]
    return Derivation(
        "modal",
        "modal accelerations due to a load",
        (S_FF, E_F, MODAL_GAIN, FRAME_DEVIATION),
        (response, MODAL_ACCELERATIONS),
        (
            Equation("S_ff^-1 e_f", response.symbol, Solve(S_FF.symbol, E_F.symbol, True)),
            Equation(
                "etadd",
                MODAL_ACCELERATIONS.symbol,
                -response.symbol - gain * FRAME_DEVIATION.symbol,
            ),
        ),
        sources=SOURCES,
    )


def step_stiffness() -> Derivation:
    """Modal rows if coordinates and rates change in proportion to the accelerations."""
    rate = Quantity(vector("rate", 1), "s", "change of the rates by the accelerations")
    inverse = Quantity(vector("sq", 1), "1/s2", "accelerations by the change of the coordinates")
    return Derivation(
        "modal",
        "modal rows within a step",
        (STIFFNESS, DAMPING, rate, inverse),
        (_accumulating(S_FF),),
        (
            Equation(
                "rate D + K / sq",
                S_FF.symbol,
                rate.symbol[0, 0] * DAMPING.symbol + 1 / inverse.symbol[0, 0] * STIFFNESS.symbol,
            ),
        ),
        sources=SOURCES,
    )


def strain_load() -> Derivation:
    """Required modal load for changes of the modal coordinates and rates."""
    return Derivation(
        "modal",
        "load of a change of the modes",
        (STIFFNESS, DAMPING, ETA, ETAD),
        (_accumulating(E_F),),
        (
            Equation(
                "K eta + D etad",
                E_F.symbol,
                STIFFNESS.symbol * ETA.symbol + DAMPING.symbol * ETAD.symbol,
            ),
        ),
        sources=SOURCES,
    )


STEPS = (
    assemble_port, rebase, carry_columns, condense, recover, port_deviation, prescribed_load,
    outboard_load, modal_effort, column_load, column_acceleration, step_stiffness, strain_load,
)  # fmt: skip
