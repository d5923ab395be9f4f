"""Explicit Runge-Kutta steps with stronger and stronger dampers."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import relative_growth
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import rod_with_spring

STIFFNESS, STEP, STEPS = 100.0, 1e-3, 400


def _growth(damping: float, method: str) -> float:
    return relative_growth(rod_with_spring(STIFFNESS, damping), STEP, STEPS, method)


CASE = CaseDefinition(
    name="rk4-damping",
    title="Explicit steps: strength of a damper",
    cause="A strong damper stops a motion within a time that is unrelated to the motion that "
    "follows. Explicit steps must still be shorter than 2.785 times that time, or they are "
    "unstable; implicit ones need not resolve it.",
    parameter="damping of a rod's pin", unit="N m s/rad", low=1.0, high=1e8, scale=LOG_SCALE,
    measured="largest over initial angle in 400 steps", limit=1.01,
    method=MethodDefinition("rk4, h = 1 ms", lambda c: _growth(c, "rk4")),
    remedy=MethodDefinition("rodas4p2, h = 1 ms", lambda c: _growth(c, "rodas4p2")), reach=1e10,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.2",
)  # fmt: skip
