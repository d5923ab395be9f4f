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
_DIGITS, _STATIC_WAVENUMBER = 120, mpmath.mpf(10) ** -12


@cache
def _root_stiffness(numbers: str) -> Callable[[Any], Any]:
    """Load on the root per unit of its displacement as a function of z, for unit beams.

    Length and stiffness of the beam are 1.
    """
    numerator, divisor = beam_stiffness()
    (z,) = divisor.free_symbols
    function: Callable[[Any], Any] = sp.lambdify(z, numerator[0, 0] / divisor, numbers)
    return function


def quotient_inertia(z: float) -> float:
    """Inertia, (static - dynamic stiffness) / z^4, in doubles; NaN after an overflow."""
    with mpmath.workdps(_DIGITS):
        static = float(_root_stiffness("mpmath")(_STATIC_WAVENUMBER))
    with np.errstate(over="ignore", invalid="ignore"):
        return float((static - _root_stiffness("numpy")(z)) / z**4)


def exact_inertia(z: float) -> float:
    """Inertia as in `quotient_inertia`, with enough digits to avoid cancellation."""
    with mpmath.workdps(_DIGITS):
        stiffness = _root_stiffness("mpmath")
        return float(
            (stiffness(_STATIC_WAVENUMBER) - stiffness(mpmath.mpf(z))) / mpmath.mpf(z) ** 4
        )
