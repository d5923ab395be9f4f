"""Rosenbrock steps with a stiff spring moved by a prescribed motion."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

STEP = 0.05

#: Output times of the error, s, after the transient of the start.
TIMES = np.linspace(1.0, 2.0, 21)


def _error(stiffness: float, method: str) -> float:
    slide = {"type": "prismatic", "axis": [1, 0, 0]}
    law = {"stiffness": stiffness, "damping": 2 * float(np.sqrt(stiffness))}
    bodies = [{"name": "base", "mass": 1.0}, {"name": "mass", "mass": 1.0}]
    hinges = [
        {"name": "road", "inboard": "ground", "outboard": "base", "drive": "0.1*sin(3*t)", **slide},
        {"name": "spring", "inboard": "base", "outboard": "mass", "law": law, **slide},
    ]
    base_model = compile_looped({"gravity": [0, 0, 0], "body": bodies, "hinge": hinges})
    reference = simulate_to_end(
        base_model, 2.0, "rodas5p", rtol=1e-12, atol=1e-16, output_times=TIMES
    )
    run = simulate_to_end(base_model, 2.0, method, STEP, output_times=TIMES)
    stretch = reference.q[:, 1]
    return float(np.abs(run.q[:, 1] - stretch).max() / np.abs(stretch).max())


CASE = CaseDefinition(
    name="order-reduction",
    title="Order reduction: a stiff spring moved by a drive",
    cause="Where a stiff spring is moved from outside, the error of a stage is that of the moved "
    "base and not that of the motion. The table of fourth order is of second order here, and its "
    "error in the spring load a hundred times larger. Tables made for this case, such as Rodas4P2, "
    "keep their order.",
    parameter="stiffness of the spring (of 1 kg, critically damped)", unit="N/m",
    low=10.0, high=1e7, scale=LOG_SCALE,
    measured="error of the spring's load, relative", limit=2e-6,
    method=MethodDefinition("rodas4, h = 50 ms", lambda k: _error(k, "rodas4")),
    remedy=MethodDefinition("rodas4p2, h = 50 ms", lambda k: _error(k, "rodas4p2")), reach=1e10,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, VI.4; Steinebach, "
    "in Progress in Differential-Algebraic Equations II, 2020",
)  # fmt: skip
