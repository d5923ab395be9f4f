"""Springs and dampers that keep closed loops together."""

from __future__ import annotations

from functools import cache

import numpy as np

from ....runtime.engine.loops.loop_calls import LoopCalls
from ....runtime.model.model import Model
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, four_bar
from ...variants import baumgarte

STEP, STEPS = 5e-3, 300


@cache
def _linkage() -> Model:
    return compile_looped(four_bar(speed=6.0))


def _stabilised_gap(rate: float) -> float:
    return baumgarte.largest_gap(_linkage(), STEP, STEPS, rate / STEP)


@cache
def _projected_gap() -> float:
    linkage = _linkage()
    times = STEP * np.arange(STEPS + 1)
    run = simulate_to_end(linkage, times[-1], "rk4", STEP, output_times=times)
    calls, still = LoopCalls(linkage.looped, run.q[0]), np.zeros(linkage.nu)
    return max(
        float(np.abs(calls.correction(calls.position_level, q, still)[1]).max()) for q in run.q
    )


CASE = CaseDefinition(
    name="baumgarte",
    title="Closed loops with springs and dampers: a four-bar",
    cause="Accelerations that satisfy the constraints leave the position gap of a loop to the "
    "errors of the steps, and it grows. Baumgarte closes it by a spring and a damper, whose rate "
    "the user has to choose. A low rate has little effect. A high one makes the equations stiff, "
    "until the steps are too long for it. Projecting positions and speeds after each step needs no "
    "such number, and leaves only rounding.",
    parameter="rate of the springs times step", unit="", low=0.05, high=10.0, scale=LOG_SCALE,
    measured="largest gap in 1.5 s, m or rad", limit=1e-3,
    method=MethodDefinition("rk4, h = 5 ms, Baumgarte's rates", _stabilised_gap),
    remedy=MethodDefinition("rk4, h = 5 ms, projection", lambda rate: _projected_gap()), reach=10.0,
    source="Baumgarte, Computer Methods in Applied Mechanics and Engineering 1, 1972; Hairer, "
    "Lubich, Wanner, Geometric Numerical Integration, 2006, IV.4",
)  # fmt: skip
