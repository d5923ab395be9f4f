"""Motion of coordinates at steady rates."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mstmm.arrays import Array


def move_steadily(q: Array, rates: Array, dt: float, quaternions: Iterable[int]) -> Array:
    """q (nq,) after dt (s) at `rates` (nq,); unit quaternions, which begin at the indices
    `quaternions`, turn at a steady angular velocity and stay units."""
    found = q + rates * dt
    for first in quaternions:
        four = slice(first, first + 4)
        rate = float(np.linalg.norm(rates[four]))
        if rate > 0:
            found[four] = np.cos(rate * dt) * q[four] + np.sin(rate * dt) / rate * rates[four]
    return found
