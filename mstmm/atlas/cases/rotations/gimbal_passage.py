"""Three angles that pass the attitude at which they are singular."""

from __future__ import annotations

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import spinning_top

STEP, T_END = 1e-3, 2.0


def _final_attitude(kind: str, distance: float, *method: str | float, **options: float) -> Array:
    """Final attitude (quaternion) of a body that rotates at about 1 rad/s.

    It passes an attitude whose second angle is `distance` rad below 90 degrees.
    """
    half = distance / 2
    start = [0.0, 0.0, distance] if kind == "gimbal" else [np.cos(half), 0.0, 0.0, np.sin(half)]
    angular_velocity = [np.sin(distance), np.cos(distance), 0.0]
    model = spinning_top(kind)
    run = simulate_to_end(
        model, T_END, *method, initial=(start, angular_velocity), output_times=[T_END], **options
    )
    return np.asarray(run.orientation("top")[-1])


def _error(distance: float, kind: str) -> float:
    exact = _final_attitude("ball", distance, rtol=1e-13, atol=1e-15)
    attitude = _final_attitude(kind, distance, "rk4", STEP)
    return float(min(np.abs(attitude - exact).max(), np.abs(attitude + exact).max()))


CASE = CaseDefinition(
    name="gimbal-passage",
    title="Three angles: the attitude at which they are singular",
    cause="Where the second of three angles passes 90 degrees, the axes of the first and the third "
    "coincide. Their rates grow without bound, and steps that are accurate elsewhere lose all "
    "digits. Whether a step hits or jumps over the attitude is a matter of chance. The quaternion "
    "of a ball hinge has no such attitude.",
    parameter="distance of the second angle from 90 degrees",
    unit="rad",
    low=1e-5,
    high=0.5,
    scale=LOG_SCALE,
    measured="error of the attitude after 2 s",
    limit=1e-6,
    method=MethodDefinition(
        "gimbal, rk4 with h = 1 ms", lambda distance: _error(distance, "gimbal")
    ),
    remedy=MethodDefinition("ball, rk4 with h = 1 ms", lambda distance: _error(distance, "ball")),
    reach=1e-8,
    source="Shabana, Dynamics of Multibody Systems, 2020, ch. 2 (singularity of Euler angles); "
    "matrices of ball hinges: Rui, Wang, Zhang, 2019, ch. 5 (5.49)",
)
