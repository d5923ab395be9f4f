"""Implicit fixed steps of an unstable motion."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, rod

STEP, INITIAL_ANGLE = 0.01, 1e-9

#: Duration of a run, in time constants of growth.
TIME_CONSTANTS = 8.0


def _inverted_rod(weight: float) -> dict[str, object]:
    pin = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
        "initial": {"q": [INITIAL_ANGLE]},
    }  # fmt: skip
    return {"gravity": [-weight, 0, 0], "body": [rod("rod")], "hinge": [pin]}


def _error(rate: float, fixed_step: bool) -> float:
    """Relative error; `rate` is the step times the growth rate of an inverted rod on its pin."""
    unit_model = compile_looped(_inverted_rod(1.0))
    slope = float(unit_model.derivatives(np.zeros(1), np.zeros(1)).q[0, 0])
    falling = compile_looped(_inverted_rod((rate / STEP) ** 2 / slope))
    t_end = max(1, round(TIME_CONSTANTS / rate)) * STEP
    exact = simulate_to_end(falling, t_end, rtol=1e-11, atol=1e-22, output_times=[t_end]).q
    if fixed_step:
        angles = simulate_to_end(falling, t_end, "genalpha", STEP, output_times=[t_end]).q
    else:
        angles = simulate_to_end(
            falling, t_end, "rodas4p2", rtol=1e-5, atol=1e-7 * INITIAL_ANGLE, output_times=[t_end]
        ).q
    return abs(float(angles[-1, 0] / exact[-1, 0]) - 1)


CASE = CaseDefinition(
    name="unstable-motion",
    title="Implicit steps: an unstable motion",
    cause="Implicit steps damp fast motion, including fast growth. For an inverted or buckled body "
    "a step of half the time constant of growth is inaccurate. At twice that time the matrix of "
    "the step changes its sign: the run reports this and ends. The error of the step shows it, but "
    "fixed steps do not use it.",
    parameter="step times rate of growth", unit="", low=0.01, high=8.0, scale=LOG_SCALE,
    measured="error of the displacement, relative", limit=0.1,
    method=MethodDefinition("genalpha, h = 10 ms", lambda rate: _error(rate, True)),
    remedy=MethodDefinition("rodas4p2, rtol 1e-5", lambda rate: _error(rate, False)), reach=8.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.3",
)  # fmt: skip
