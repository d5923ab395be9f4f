"""The quarter car of `benchmarks.stiff.scenes` without any multibody program."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import scipy.linalg

from benchmarks.stiff import scenes

Array = npt.NDArray[np.float64]
GRAVITY = 9.81


def quarter_car_at(t_end: float) -> Array:
    """Heights (m) of wheel, plate and body: linear equations, with the road's waves as states of
    their own, by one matrix exponential."""
    masses = [mass for mass, _ in scenes.QUARTER.values()]
    springs = [law for _, law in scenes.QUARTER.values()]
    waves = [(0.02, 3 * np.pi), (0.001, 24 * np.pi)]
    one, size = 6, 7 + 2 * len(waves)  # heights, speeds, 1, (cos, sin) of each wave
    L = np.zeros((size, size))
    road, road_rate = np.zeros(size), np.zeros(size)
    for i, (height, w) in enumerate(waves):
        cosine, sine = 7 + 2 * i, 8 + 2 * i
        L[cosine, sine], L[sine, cosine] = -w, w
        road[one] += height
        road[cosine] -= height
        road_rate[sine] += height * w
    places = [road, *np.eye(size)[:3]]
    speeds = [road_rate, *np.eye(size)[3:6]]
    L[:3] = speeds[1:]
    for i, (k, c) in enumerate(springs):
        force = k * (places[i] - places[i + 1]) + c * (speeds[i] - speeds[i + 1])
        L[3 + i] += force / masses[i]
        if i:
            L[2 + i] -= force / masses[i - 1]
        L[3 + i, one] -= GRAVITY
    start = np.zeros(size)
    start[[one, *range(7, size, 2)]] = 1.0
    return np.asarray((scipy.linalg.expm(L * t_end) @ start)[:3])
