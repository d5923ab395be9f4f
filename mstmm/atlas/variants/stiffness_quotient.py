"""Inertia of a vibrating beam from the quotients of its dynamic stiffness."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from ...derive.classical.harmonic_stiffness import beam_stiffness

#: Digits of exact values, and a wave number at which they give only the static stiffness.
_DIGITS, _STILL = 120, mpmath.mpf(10) ** -12


@cache
def _at_root(numbers: str) -> Callable[[Any], Any]:
    """Load on the root per unit of its displacement as a function of z, for unit beams.

    Length and stiffness of the beam are 1.
    """
    numerator, divisor = beam_stiffness()
    (z,) = divisor.free_symbols
    found: Callable[[Any], Any] = sp.lambdify(z, numerator[0, 0] / divisor, numbers)
    return found


def inertia(z: float) -> float:
    """Inertia, (static - dynamic stiffness) / z^4, in doubles; NaN after an overflow."""
    with mpmath.workdps(_DIGITS):
        static = float(_at_root("mpmath")(_STILL))
    with np.errstate(over="ignore", invalid="ignore"):
        return float((static - _at_root("numpy")(z)) / z**4)


def exact(z: float) -> float:
    """Inertia as in `inertia`, with enough digits to avoid cancellation."""
    with mpmath.workdps(_DIGITS):
        stiffness = _at_root("mpmath")
        return float((stiffness(_STILL) - stiffness(mpmath.mpf(z))) / mpmath.mpf(z) ** 4)
