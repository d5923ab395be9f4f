"""Frequencies of a clamped-free beam by the signs of a determinant of transfer matrices."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq

from ...derive.classical.harmonic_beam import BETA, LENGTH, field_matrix

#: Number of values of the determinant in the window of one mode.
_WINDOW_POINTS = 41


@cache
def _field_function() -> Any:
    return sp.lambdify([BETA, LENGTH], field_matrix(), "numpy")


def determinant(beta: float, parts: int) -> float:
    """Determinant of the conditions at the free end, for a beam of length 1 in `parts` elements.

    Rows are moment and shear force there, columns those of the clamped end.
    """
    chain = np.linalg.matrix_power(np.asarray(_field_function()(beta, 1 / parts)), parts)
    return float(chain[2, 2] * chain[3, 3] - chain[2, 3] * chain[3, 2])


def clamped_free_wavenumber(number: int, parts: int) -> float:
    """beta L of a mode; NaN unless the determinant changes its sign once in the window."""
    window = np.linspace((number - 1) * np.pi, number * np.pi, _WINDOW_POINTS) + 0.1
    values = np.array([determinant(float(beta), parts) for beta in window])
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)
    if len(changes) != 1:
        return float("nan")
    first = int(changes[0])
    return float(brentq(determinant, window[first], window[first + 1], args=(parts,), xtol=1e-13))
