"""Closed loops stabilised by springs and dampers (Baumgarte) instead of a projection.

Gaps g of the loops satisfy g'' + 2 alpha g' + alpha^2 g = 0 instead of g'' = 0.  The accelerations
get the corrections of position gap and velocity error, times alpha^2 and 2 alpha (J. Baumgarte,
Computer Methods in Applied Mechanics and Engineering 1 (1972) 1-16).
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.engine.loops.loop_calls import LoopCalls
from ...runtime.model.model import Model
from .runge_kutta import rk4_step


def largest_gap(model: Model, step: float, steps: int, rate: float) -> float:
    """Largest gap (m, rad) in `steps` steps (s) of rk4 with alpha = `rate` (1/s).

    For hinges whose coordinates are integrals of their speeds.  NaN if a state is not finite.
    """
    engine, (q, u) = model.looped, model.initial_state()
    calls, memory, position_count = (
        LoopCalls(engine, q),
        np.atleast_2d(engine.start_memory()),
        model.nq,
    )

    def state_rate(y: Array) -> Array:
        q, u = np.ascontiguousarray(y[:position_count]), np.ascontiguousarray(y[position_count:])
        rates = engine.accelerations(0.0, q[None], u[None], memory)
        position_correction = calls.correction(calls.position_level, q, u)[0]
        velocity_correction = calls.correction(calls.velocity_level, q, u)[0]
        return np.append(
            rates[0][0],
            rates[1][0] + rate**2 * position_correction + 2 * rate * velocity_correction,
        )

    y, largest = np.append(q, u), 0.0
    for _ in range(steps):
        y = rk4_step(state_rate, y, step)
        if not np.isfinite(y).all() or np.abs(y).max() > 1e6:
            return float("nan")
        gap = calls.correction(calls.position_level, np.ascontiguousarray(y[:position_count]), u)[1]
        largest = max(largest, float(np.abs(gap).max()))
    return largest
