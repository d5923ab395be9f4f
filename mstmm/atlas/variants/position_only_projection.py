"""Closed loops with a projection of positions after each step, but not of speeds.

The velocity error of the constraints remains, and opens gaps again in the next step (E. Hairer, C.
Lubich, G. Wanner, Geometric Numerical Integration, 2006, IV.4).
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.engine.loops.loop_calls import LoopCalls
from ...runtime.model.model import Model
from .runge_kutta import rk4_step

#: Number of corrections of the gaps after a step, which converge quadratically.
_CORRECTION_COUNT = 3


def largest_velocity_error(model: Model, step: float, steps: int) -> float:
    """Largest velocity error (m/s, rad/s) of the loops in `steps` steps (s) of rk4.

    For hinges whose coordinates are integrals of their speeds.  NaN if a state is not finite.
    """
    engine, (q, u) = model.looped, model.initial_state()
    calls, memory, largest = LoopCalls(engine, q), np.atleast_2d(engine.start_memory()), 0.0

    def state_rate(y: Array) -> Array:
        q, u = (np.ascontiguousarray(part) for part in np.split(y, [model.nq]))
        rates = engine.accelerations(0.0, q[None], u[None], memory)
        return np.append(rates[0][0], rates[1][0])

    for _ in range(steps):
        y = rk4_step(state_rate, np.append(q, u), step)
        if not np.isfinite(y).all() or np.abs(y).max() > 1e6:
            return float("nan")
        q, u = (np.ascontiguousarray(part) for part in np.split(y, [model.nq]))
        for _ in range(_CORRECTION_COUNT):
            q = q + calls.correction(calls.position_level, q, u)[0]
        largest = max(largest, float(np.abs(calls.correction(calls.velocity_level, q, u)[1]).max()))
    return largest
