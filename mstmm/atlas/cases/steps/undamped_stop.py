"""Fixed steps across an elastic stop."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

STEP, PHASE_COUNT = 0.01, 40


def _rebound(rate: float, fixed_step: bool) -> float:
    """Energy of 1 kg after a stop, relative to that before, at 1 m/s.

    It is the largest over PHASE_COUNT instants within a step at which the contact starts.
    """
    stop = {"lower": 0.0, "stiffness": (rate / STEP) ** 2, "damping": 0.0}
    slide = {
        "name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "mass", "law": {"limits": stop},
    }  # fmt: skip
    mass = {"name": "mass", "mass": 1.0}
    mass_model = compile_looped({"gravity": [0, 0, 0], "body": [mass], "hinge": [slide]})
    t_end = STEP * round((np.pi / rate) + 8)
    speeds = []
    for phase in np.arange(PHASE_COUNT) / PHASE_COUNT:
        start = [STEP * (1 + phase)], [-1.0]
        settings = {"step": STEP} if fixed_step else {"rtol": 1e-6, "atol": 1e-9}
        run = simulate_to_end(mass_model, t_end, "genalpha", initial=start, **settings)
        speeds.append(float(run.u[-1, 0]))
    return max(speeds) ** 2


CASE = CaseDefinition(
    name="undamped-stop",
    title="Fixed steps across a stop without damping",
    cause="A stop is a spring that starts suddenly. The contact occurs within a step, but the step "
    "assumes it from its start or its end on, so that the rebound has another energy than the "
    "approach. It is larger or smaller depending on the position within the step, and more so the "
    "stiffer the stop. Steps with error control shrink until the contact is resolved.",
    parameter="step times angular frequency on the stop",
    unit="",
    low=0.1,
    high=100.0,
    scale=LOG_SCALE,
    measured="energy after over that before the rebound",
    limit=1.05,
    method=MethodDefinition("genalpha, fixed steps", lambda rate: _rebound(rate, True)),
    remedy=MethodDefinition("genalpha, rtol = 1e-6", lambda rate: _rebound(rate, False)),
    reach=1e4,
    source="Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.6",
)
