"""Rosenbrock steps over a road without the time derivative of the equations."""

from __future__ import annotations

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped
from ...variants.bare_rosenbrock import BareRosenbrock

STEP, STEPS = 0.01, 200
#: Height of the waves, m.
WAVE_HEIGHT = 0.01

TIMES = STEP * np.arange(STEPS + 1)


def _road(rate: float) -> dict[str, object]:
    """Scene of 1 kg on a spring of 400 N/m and a damper of 12 N s/m over waves.

    The waves pass with an angular frequency of `rate` over the step.
    """
    wave = f"{rate / STEP!r}"
    effort = f"400*({WAVE_HEIGHT}*sin({wave}*t) - q) + 12*({WAVE_HEIGHT}*{wave}*cos({wave}*t) - u)"
    slide = {
        "name": "slide", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
        "outboard": "mass", "law": {"effort": effort},
    }  # fmt: skip
    return {"gravity": [0, 0, 0], "body": [{"name": "mass", "mass": 1.0}], "hinge": [slide]}


def _error(rate: float, time_slope: bool) -> float:
    car = compile_looped(_road(rate))
    exact = simulate_to_end(car, TIMES[-1], rtol=1e-11, atol=1e-15, output_times=TIMES).q[:, 0]
    displacement: Array
    if time_slope:
        displacement = simulate_to_end(car, TIMES[-1], "rodas4", STEP, output_times=TIMES).q[:, 0]
    else:
        displacement = BareRosenbrock(car, "rodas4", time_slope=False).fixed_step_states(
            STEP, STEPS
        )[:, 0, 0]
    return float(np.abs(displacement - exact).max() / WAVE_HEIGHT)


CASE = CaseDefinition(
    name="time-slope",
    title="Rosenbrock steps without the time derivative: a road",
    cause="A linearised step needs the time derivative of the equations, as it needs the tangent "
    "matrix for the coordinates. Where drives, roads or loads depend on time and that derivative "
    "is left out, the table is of first order. Runs include it; tables of W-methods, such as "
    "ROS34PW2, do not need it.",
    parameter="step times angular frequency of the road",
    unit="",
    low=1e-4,
    high=1.0,
    scale=LOG_SCALE,
    measured="error of the displacement over wave height",
    limit=1e-3,
    method=MethodDefinition(
        "rodas4 without the derivative, h = 10 ms", lambda rate: _error(rate, False)
    ),
    remedy=MethodDefinition("rodas4, h = 10 ms", lambda rate: _error(rate, True)),
    reach=10.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7; Rang, "
    "Angermann, BIT 45, 2005 (W-methods)",
)
