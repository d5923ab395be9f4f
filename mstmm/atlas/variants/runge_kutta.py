"""Step of the classical Runge-Kutta method, for variants with modified equations."""

from __future__ import annotations

from collections.abc import Callable

from ...array_validation import Array


def rk4_step(slope: Callable[[Array], Array], y: Array, step: float) -> Array:
    """State y after one step (s) of y' = slope(y)."""
    first = slope(y)
    second = slope(y + step / 2 * first)
    third = slope(y + step / 2 * second)
    return y + step / 6 * (first + 2 * second + 2 * third + slope(y + step * third))
