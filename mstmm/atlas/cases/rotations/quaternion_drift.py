"""Length of a quaternion that is integrated as four numbers."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import spinning_top
from ...variants import unnormalised_quaternions

#: Length of a run, s, and the angular velocity of the body, rad/s.
T_END, SPIN = 50.0, (0.4, 1.6, 1.1)


def _drift(step: float) -> float:
    q = unnormalised_quaternions.final_coordinates(
        spinning_top("ball", SPIN), step, round(T_END / step)
    )
    return abs(float(np.linalg.norm(q)) - 1)


def _normalised_drift(step: float) -> float:
    run = simulate_to_end(spinning_top("ball", SPIN), round(T_END / step) * step, "rk4", step)
    return float(np.abs(np.linalg.norm(run.q, axis=1) - 1).max())


CASE = CaseDefinition(
    name="quaternion-drift",
    title="Quaternions as four numbers: their length",
    cause="Four numbers for three rotations are constrained by their length, which a method of "
    "integration does not preserve. The length decreases per step with the sixth power of the "
    "step, and a quaternion of another length gives no orthonormal axes. Every run normalises "
    "quaternions after each step.",
    parameter="length of a step", unit="s", low=5e-3, high=0.5, scale=LOG_SCALE,
    measured="change of the length in 50 s", limit=1e-6,
    method=MethodDefinition("rk4, length not restored", _drift),
    remedy=MethodDefinition("rk4, length restored after each step", _normalised_drift), reach=0.5,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 2; Shabana, "
    "Dynamics of Multibody Systems, 2020, ch. 2",
)  # fmt: skip
