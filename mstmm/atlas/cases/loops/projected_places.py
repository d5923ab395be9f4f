"""Loop with positions projected after each step, but not its speeds."""

from __future__ import annotations

import numpy as np

from ....runtime.engine.loops.calls import LoopCalls
from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import four_bar, model
from ...variants import projected_places

T_END = 1.5


def _of_places(step: float) -> float:
    return projected_places.slip_of(model(four_bar(speed=6.0)), step, round(T_END / step))


def _of_both(step: float) -> float:
    linkage, times = model(four_bar(speed=6.0)), step * np.arange(round(T_END / step) + 1)
    run = simulated(linkage, times[-1], "rk4", step, output_times=times)
    calls = LoopCalls(linkage.looped, run.q[0])
    states = zip(run.q, run.u, strict=True)
    return max(float(np.abs(calls.correction(calls.slip, *one)[1]).max()) for one in states)


CASE = Definition(
    name="projected-places",
    title="Closed loops with projection of positions only: a four-bar",
    why="Projected positions make the loop look closed after each step. Its speeds still violate "
    "the constraints, and the next step follows them: angles of this four-bar have 6 to 18 times "
    "the error of a run with projected speeds. That projection costs one more pass with factors "
    "that are available.",
    parameter="length of a step", unit="s", low=1e-3, high=0.02, scale=LOG,
    measured="largest velocity error in 1.5 s, m/s or rad/s", limit=1e-5,
    method=Method("rk4, positions projected", _of_places),
    remedy=Method("rk4, positions and speeds projected", _of_both), reach=0.02,
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, 2006, IV.4; Eich, SIAM "
    "Journal on Numerical Analysis 30, 1993 (both projected)",
)  # fmt: skip
