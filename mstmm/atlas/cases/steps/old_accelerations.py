"""Implicit steps that start with accelerations from before an event."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import double_pendulum
from ...variants.bare_rosenbrock import BareRosenbrock

T_END = 0.5


def _error(step: float, use_old: bool) -> float:
    rods, steps = double_pendulum(), round(T_END / step)
    step = T_END / steps
    exact = simulate_to_end(rods, T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]).q[-1]
    if use_old:
        angles = BareRosenbrock(rods, "rodas5p", accelerations=np.zeros(2)).fixed_step_states(
            step, steps
        )[-1, 0]
    else:
        angles = simulate_to_end(rods, T_END, "rodas5p", step, output_times=[T_END]).q[-1]
    return float(np.abs(angles - exact).max())


CASE = CaseDefinition(
    name="old-accelerations",
    title="Accelerations from before an event: rods that are released",
    cause="Steps with accelerations as unknowns start from those of the step before. After a "
    "release, an impact or a sudden load these belong to other equations: the tangent is that of a "
    "wrong state. The first step then has a lasting error of lower order. Here two rods are "
    "released whose accelerations were zero before. One evaluation corrects them; every run makes "
    "it after each event and each discontinuity of the equations.",
    parameter="length of a step", unit="s", low=1e-3, high=0.05, scale=LOG_SCALE,
    measured="error of the angles after 0.5 s, rad", limit=1e-9,
    method=MethodDefinition("rodas5p, accelerations kept", lambda step: _error(step, True)),
    remedy=MethodDefinition("rodas5p", lambda step: _error(step, False)), reach=0.05,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 and VI.4",
)  # fmt: skip
