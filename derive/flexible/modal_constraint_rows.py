"""Rows of closed loops through a flexible body, in terms of its modes.

A row has a column K of the frame and one of the modes, K_f, its coefficients of their
accelerations. A port adds H^T K, as does the supported section if the frame is another one.  With
the modes eliminated, etadd = g - G a - S_ff^-1 K_f x,

    K -= G^T K_f,  L_ij += K_f,i . S_ff^-1 K_f,j,  l += K_f . g
"""

from __future__ import annotations

from ..definition.derivation import Derivation, Equation, Quantity, Solve
from ..definition.notation import symbol
from .modal_residual import S_FF, modal_vector
from .modal_sweep import MODAL_ACCELERATIONS, MODAL_GAIN, MODAL_SUBSPACE

SOURCES = ("Vereshchagin, Engng. Cybern. 6 (1974) 1343-1349 (multipliers in the sweep)",)

FRAME_COLUMN = Quantity(symbol("K", 6), "", "column of the row on the frame")
MODAL_COLUMN = modal_vector("K_f", "column of the row on the modes")
MODAL_RESPONSE = modal_vector("Y", "S_ff^-1 K_f")


def _accumulating(quantity: Quantity) -> Quantity:
    return Quantity(quantity.symbol, quantity.unit, quantity.meaning, accumulate=True)


def modal_column() -> Derivation:
    """Modal column of a row at a section."""
    return Derivation(
        "modal",
        "row on the modes",
        (MODAL_SUBSPACE, FRAME_COLUMN),
        (_accumulating(MODAL_COLUMN),),
        (Equation("H^T K", MODAL_COLUMN.symbol, MODAL_SUBSPACE.symbol.T * FRAME_COLUMN.symbol),),
        sources=SOURCES,
    )


def condense_row() -> Derivation:
    """A row after elimination of the modes."""
    known_part = Quantity(symbol("l", 1), "", "known part of the row", accumulate=True)
    gain = MODAL_GAIN.symbol
    return Derivation(
        "modal",
        "row of a flexible body condensed",
        (S_FF, MODAL_COLUMN, MODAL_GAIN),
        (MODAL_RESPONSE, _accumulating(FRAME_COLUMN), known_part),
        (
            Equation(
                "S_ff^-1 K_f", MODAL_RESPONSE.symbol, Solve(S_FF.symbol, MODAL_COLUMN.symbol, True)
            ),
            Equation("-G^T K_f", FRAME_COLUMN.symbol, -gain[:, :6].T * MODAL_COLUMN.symbol),
            Equation("K_f . g", known_part.symbol, -gain[:, 6:].T * MODAL_COLUMN.symbol),
        ),
        sources=SOURCES,
    )


def row_coupling() -> Derivation:
    """Contribution of the modes of one body to the entry of L of two rows."""
    entry = Quantity(symbol("L_ij", 1), "", "entry of L", accumulate=True)
    return Derivation(
        "modal",
        "rows coupled by modes",
        (MODAL_COLUMN, MODAL_RESPONSE),
        (entry,),
        (
            Equation(
                "K_f,i . S_ff^-1 K_f,j", entry.symbol, MODAL_COLUMN.symbol.T * MODAL_RESPONSE.symbol
            ),
        ),
        sources=SOURCES,
    )


def multiplier_acceleration() -> Derivation:
    """Modal accelerations due to the multiplier of a row."""
    multiplier = Quantity(symbol("x", 1), "", "multiplier of the row")
    return Derivation(
        "modal",
        "modal accelerations by a multiplier",
        (MODAL_RESPONSE, multiplier),
        (_accumulating(MODAL_ACCELERATIONS),),
        (Equation("-Y x", MODAL_ACCELERATIONS.symbol, -MODAL_RESPONSE.symbol * multiplier.symbol),),
        sources=SOURCES,
    )


STEPS = (modal_column, condense_row, row_coupling, multiplier_acceleration)
