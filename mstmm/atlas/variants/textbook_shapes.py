"""Bending shapes of a clamped-free beam as hyperbolic functions, as they are usually printed."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...runtime.flexible.beam.shapes import root


def clamped_free(number: int, xi: Array) -> Array:
    """Shape number `number` at parts `xi` of the length, scaled to int phi^2 dxi = 1.

    Rao, Vibration of Continuous Systems, ch. 11; beta by the root that all shapes share.
    """
    b = root("clamped-free", number)
    with np.errstate(over="ignore", invalid="ignore"):
        sigma = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        hyperbolic = np.cosh(b * xi) - sigma * np.sinh(b * xi)
    return np.asarray(hyperbolic - np.cos(b * xi) + sigma * np.sin(b * xi))
