"""Motion of coordinates with constant rates."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mstmm.arrays import Array


def move_steadily(q: Array, rates: Array, dt: float, quaternions: Iterable[int]) -> Array:
    """Move q (nq,) by dt (s) with constant `rates` (nq,).

    Unit quaternions, which begin at the indices `quaternions`, rotate at constant angular velocity
    and keep unit length.
    """
    found = q + rates * dt
    for first in quaternions:
        four = slice(first, first + 4)
        rate = float(np.linalg.norm(rates[four]))
        if rate > 0:
            found[four] = np.cos(rate * dt) * q[four] + np.sin(rate * dt) / rate * rates[four]
    return found
