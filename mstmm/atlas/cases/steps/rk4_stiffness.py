"""Explicit Runge-Kutta steps with stiffer and stiffer springs."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import relative_growth
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import rod_with_spring

STEP, STEPS = 1e-3, 400


def _growth(stiffness: float, method: str) -> float:
    return relative_growth(rod_with_spring(stiffness), STEP, STEPS, method)


CASE = CaseDefinition(
    name="rk4-stiffness",
    title="Explicit steps: stiffness of a spring",
    cause="An explicit step must resolve the fastest vibration whether it is wanted or not. The "
    "classical Runge-Kutta method is stable as long as the step times its angular frequency is "
    "below the square root of 8. Implicit steps stay bounded for any stiffness (for the accuracy "
    "of the vibration see numerical-damping).",
    parameter="stiffness of a rod's pin", unit="N m/rad", low=1e2, high=1e10, scale=LOG_SCALE,
    measured="largest over initial angle in 400 steps", limit=1.01,
    method=MethodDefinition("rk4, h = 1 ms", lambda k: _growth(k, "rk4")),
    remedy=MethodDefinition("genalpha, h = 1 ms", lambda k: _growth(k, "genalpha")), reach=1e12,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.2",
)  # fmt: skip
