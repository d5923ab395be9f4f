"""Inertia of a vibrating beam by the quotients of its dynamic stiffness, near rest and far off."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from ...derive.classical.harmonic_stiffness import beam_stiffness

#: Digits of what is exact, and a wave number at which they show the static stiffness alone.
_DIGITS, _STILL = 120, mpmath.mpf(10) ** -12


@cache
def _at_root(numbers: str) -> Callable[[Any], Any]:
    """Load on the root by its displacement, of length and stiffness 1, over z."""
    numerator, divisor = beam_stiffness()
    (z,) = divisor.free_symbols
    found: Callable[[Any], Any] = sp.lambdify(z, numerator[0, 0] / divisor, numbers)
    return found


def inertia(z: float) -> float:
    """(static - dynamic stiffness) / z^4 in numbers of 16 digits; nan where these end."""
    with mpmath.workdps(_DIGITS):
        static = float(_at_root("mpmath")(_STILL))
    with np.errstate(over="ignore", invalid="ignore"):
        return float((static - _at_root("numpy")(z)) / z**4)


def exact(z: float) -> float:
    """The same in numbers of so many digits that nothing cancels."""
    with mpmath.workdps(_DIGITS):
        stiffness = _at_root("mpmath")
        return float((stiffness(_STILL) - stiffness(mpmath.mpf(z))) / mpmath.mpf(z) ** 4)
