"""Bending shapes of a clamped-free beam by hyperbolic functions, in the usual printed form."""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.flexible.beam.shape_functions import wave_number


def clamped_free_shape(number: int, xi: Array) -> Array:
    """Shape `number` at positions `xi`, relative to the length, with int phi^2 dxi = 1.

    Rao, Vibration of Continuous Systems, ch. 11; beta from the common root of all shapes.
    """
    b = wave_number("clamped-free", number)
    with np.errstate(over="ignore", invalid="ignore"):
        sigma = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        hyperbolic = np.cosh(b * xi) - sigma * np.sinh(b * xi)
    return np.asarray(hyperbolic - np.cos(b * xi) + sigma * np.sin(b * xi))
