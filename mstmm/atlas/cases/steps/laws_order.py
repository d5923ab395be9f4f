"""Order of Rosenbrock tables with a tangent matrix of hinge laws only."""

from __future__ import annotations

from functools import cache

import numpy as np

from ....array_validation import Array
from ....runtime.integrate.methods import Implicit
from ....runtime.model.model import Model
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import elbow_with_spring
from ...variants.laws_rosenbrock import LawTangentSteps

T_END = 0.5


@cache
def _arm() -> tuple[Model, Array]:
    """Falling rods, and their exact angles at the end."""
    arm = elbow_with_spring(10.0, 0.2)
    return arm, simulate_to_end(arm, T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]).q[-1]


def _rodas4_error(step: float) -> float:
    arm, exact = _arm()
    steps = round(T_END / step)
    angles = LawTangentSteps(arm, "rodas4").fixed_step_states(T_END / steps, steps)[-1, 0]
    return float(np.abs(angles - exact).max())


def _rodas4pw_error(step: float) -> float:
    arm, exact = _arm()
    method = Implicit("rodas4pw", tangent="laws")
    run = simulate_to_end(arm, T_END, method, T_END / round(T_END / step), output_times=[T_END])
    return float(np.abs(run.q[-1] - exact).max())


CASE = CaseDefinition(
    name="laws-order",
    title="Tangent of hinge laws only: the order of a table",
    cause="Most Rosenbrock tables need the exact tangent for their order. With the derivatives of "
    "springs and dampers only, which cost less, Rodas4 falls to first order, Rodas4P2 and Rodas5P "
    "to second; runs reject that. The tables of W-methods, ROS34PW2 and Rodas4PW, keep their order "
    "with any tangent.",
    parameter="length of a step", unit="s", low=2e-4, high=0.05, scale=LOG_SCALE,
    measured="error of the angles after 0.5 s, rad", limit=1e-5,
    method=MethodDefinition("rodas4, tangent of laws", _rodas4_error),
    remedy=MethodDefinition("rodas4pw, tangent of laws", _rodas4pw_error), reach=0.05,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7; Rang, "
    "Angermann, BIT 45, 2005 (W-methods)",
)  # fmt: skip
