"""Motion of coordinates at constant rates."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from mstmm.array_validation import Array


def move_steadily(q: Array, rates: Array, dt: float, quaternions: Iterable[int]) -> Array:
    """Advance q (nq,) by dt (s) at constant `rates` (nq,).

    Unit quaternions, which begin at the indices `quaternions`, rotate at constant angular velocity
    and retain unit length.
    """
    moved = q + rates * dt
    for first in quaternions:
        quaternion = slice(first, first + 4)
        rate = float(np.linalg.norm(rates[quaternion]))
        if rate > 0:
            moved[quaternion] = (
                np.cos(rate * dt) * q[quaternion] + np.sin(rate * dt) / rate * rates[quaternion]
            )
    return moved
