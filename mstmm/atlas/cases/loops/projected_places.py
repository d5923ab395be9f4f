"""Loop with positions projected after each step, but not its speeds."""

from __future__ import annotations

import numpy as np

from ....runtime.engine.loops.loop_calls import LoopCalls
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, four_bar
from ...variants import position_only_projection

T_END = 1.5


def _error_with_positions(step: float) -> float:
    return position_only_projection.largest_velocity_error(
        compile_looped(four_bar(speed=6.0)), step, round(T_END / step)
    )


def _error_with_speeds(step: float) -> float:
    linkage, times = compile_looped(four_bar(speed=6.0)), step * np.arange(round(T_END / step) + 1)
    run = simulate_to_end(linkage, times[-1], "rk4", step, output_times=times)
    calls = LoopCalls(linkage.looped, run.q[0])
    states = zip(run.q, run.u, strict=True)
    return max(
        float(np.abs(calls.correction(calls.velocity_level, *state)[1]).max()) for state in states
    )


CASE = CaseDefinition(
    name="projected-places",
    title="Closed loops with projection of positions only: a four-bar",
    cause="Projected positions make the loop look closed after each step. Its speeds still violate "
    "the constraints, and the next step follows them: angles of this four-bar have 6 to 18 times "
    "the error of a run with projected speeds. That projection costs one more pass with factors "
    "that are available.",
    parameter="length of a step", unit="s", low=1e-3, high=0.02, scale=LOG_SCALE,
    measured="largest velocity error in 1.5 s, m/s or rad/s", limit=1e-5,
    method=MethodDefinition("rk4, positions projected", _error_with_positions),
    remedy=MethodDefinition("rk4, positions and speeds projected", _error_with_speeds), reach=0.02,
    source="Hairer, Lubich, Wanner, Geometric Numerical Integration, 2006, IV.4; Eich, SIAM "
    "Journal on Numerical Analysis 30, 1993 (both projected)",
)  # fmt: skip
