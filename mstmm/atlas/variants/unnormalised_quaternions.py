"""Runge-Kutta steps on the components of quaternions without normalisation."""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.model.model import Model


def final_coordinates(model: Model, step: float, steps: int) -> Array:
    """q (nq,) after `steps` steps (s) of rk4 from the start, with the rates of the engine."""
    engine = model.looped
    memory = np.atleast_2d(engine.start_memory())
    position_count = model.nq

    def rate(t: float, y: Array) -> Array:
        q, u = (
            np.ascontiguousarray(y[None, :position_count]),
            np.ascontiguousarray(y[None, position_count:]),
        )
        return np.concatenate([part[0] for part in engine.accelerations(t, q, u, memory)])

    y = np.concatenate(model.initial_state())
    for number in range(steps):
        t = number * step
        first = rate(t, y)
        second = rate(t + step / 2, y + step / 2 * first)
        third = rate(t + step / 2, y + step / 2 * second)
        fourth = rate(t + step, y + step * third)
        y = y + step / 6 * (first + 2 * second + 2 * third + fourth)
    return y[:position_count]
