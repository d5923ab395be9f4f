"""Rows of closed loops through a flexible body, as what hangs on its ends is seen by its modes.

A row has a column K of the frame and one of the modes, K_f: what it asks of their accelerations.
A port brings H^T K, and so does the section that is held where the frame is another one.  With the
modes eliminated, etadd = g - G a - S_ff^-1 K_f x,

    K -= G^T K_f,  L_ij += K_f,i . S_ff^-1 K_f,j,  l += K_f . g
"""

from __future__ import annotations

from ..equations.algebra import symbol
from ..language.derivation import Derivation, Equation, Quantity, Solve
from .modal import S_FF
from .modal_sweep import GAIN, RATES, H
from .symbols import column

SOURCES = ("Vereshchagin, Engng. Cybern. 6 (1974) 1343-1349 (multipliers in the sweep)",)

FRAME = Quantity(symbol("K", 6), "", "column of the row on the frame")
MODES = column("K_f", "column of the row on the modes")
ANSWERS = column("Y", "S_ff^-1 K_f")


def _grow(quantity: Quantity) -> Quantity:
    return Quantity(quantity.symbol, quantity.unit, quantity.meaning, accumulate=True)


def row_felt() -> Derivation:
    """A column at a section, on the modes."""
    return Derivation(
        "modal",
        "row on the modes",
        (H, FRAME),
        (_grow(MODES),),
        (Equation("H^T K", MODES.symbol, H.symbol.T * FRAME.symbol),),
        sources=SOURCES,
    )


def row_condensed() -> Derivation:
    """Modes eliminated from a row."""
    known = Quantity(symbol("l", 1), "", "known part of the row", accumulate=True)
    gain = GAIN.symbol
    return Derivation(
        "modal",
        "row of a flexible body condensed",
        (S_FF, MODES, GAIN),
        (ANSWERS, _grow(FRAME), known),
        (
            Equation("S_ff^-1 K_f", ANSWERS.symbol, Solve(S_FF.symbol, MODES.symbol, True)),
            Equation("-G^T K_f", FRAME.symbol, -gain[:, :6].T * MODES.symbol),
            Equation("K_f . g", known.symbol, -gain[:, 6:].T * MODES.symbol),
        ),
        sources=SOURCES,
    )


def row_coupled() -> Derivation:
    """Entry of L of two rows by the modes of one body."""
    entry = Quantity(symbol("L_ij", 1), "", "entry of L", accumulate=True)
    return Derivation(
        "modal",
        "rows coupled by modes",
        (MODES, ANSWERS),
        (entry,),
        (Equation("K_f,i . S_ff^-1 K_f,j", entry.symbol, MODES.symbol.T * ANSWERS.symbol),),
        sources=SOURCES,
    )


def row_answered() -> Derivation:
    """Modal accelerations by the multiplier of a row."""
    multiplier = Quantity(symbol("x", 1), "", "multiplier of the row")
    return Derivation(
        "modal",
        "modal accelerations by a multiplier",
        (ANSWERS, multiplier),
        (_grow(RATES),),
        (Equation("-Y x", RATES.symbol, -ANSWERS.symbol * multiplier.symbol),),
        sources=SOURCES,
    )


STEPS = (row_felt, row_condensed, row_coupled, row_answered)
