"""Smooth curves through the samples of a run with long steps."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from ..quantity_names import Quantity


#: Runs with at least this many samples are drawn unchanged; others are refined to this many.
MIN_DRAWN_POINTS = 600


def curve(t: Array, quantity: Quantity) -> tuple[Array, Array]:
    """Times (m,) and values (m, k) to draw; nan between two samples at one time (an event).

    Between samples: the cubic through values and rates where the rate is known, else Akima's
    modified interpolant, which does not overshoot at corners (H. Akima, J. ACM 17 (1970) 589-602).
    """
    values = quantity.values.reshape(len(t), -1)
    rates = None if quantity.rates is None else quantity.rates().reshape(len(t), -1)
    times, value_pieces = list[Array](), list[Array]()
    for piece in np.split(np.arange(len(t)), np.flatnonzero(np.diff(t) == 0) + 1):
        x, y = t[piece], values[piece]
        if len(t) < MIN_DRAWN_POINTS and len(piece) > 1 and np.isfinite(y).all():
            x = refine_times(x, MIN_DRAWN_POINTS / max(t[-1] - t[0], 1e-300))
            y = interpolate(t[piece], y, None if rates is None else rates[piece], x)
        times += [x, np.array([np.nan])]
        value_pieces += [y, np.full((1, values.shape[1]), np.nan)]
    return np.concatenate(times[:-1]), np.concatenate(value_pieces[:-1])


def refine_times(t: Array, density: float) -> Array:
    """Times with evenly spaced ones added between them, `density` per second or more."""
    parts = [
        np.linspace(a, b, max(2, int((b - a) * density) + 1), endpoint=False)
        for a, b in pairwise(t)
    ]
    return np.concatenate([*parts, t[-1:]])


def interpolate(t: Array, values: Array, rates: Array | None, x: Array) -> Array:
    """Values (m, k) at the times x between those at t (n,): see `curve`."""
    from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline

    if rates is not None and np.isfinite(rates).all():
        return np.asarray(CubicHermiteSpline(t, values, rates)(x))
    if len(t) < 3:
        return np.stack([np.interp(x, t, column) for column in values.T], axis=1)
    return np.asarray(Akima1DInterpolator(t, values, method="makima")(x))
