"""Generalised-alpha in its first steps from a stretched spring."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import relative_amplitudes
from ...parameter_scale import LOG_SCALE

STEPS = 20


def _overshoot(rate: float, method: str) -> float:
    return float(relative_amplitudes(rate, STEPS, method).max())


CASE = CaseDefinition(
    name="genalpha-overshoot",
    title="Generalised-alpha: speeds after a stretched spring",
    cause="Displacements do not overshoot, but speeds do, in proportion to step times frequency: "
    "the step extrapolates the acceleration of a stretched spring. Start from an equilibrium, "
    "resolve the vibration, or use a method that carries no accelerations over.",
    parameter="step times angular frequency", unit="", low=0.1, high=1e5, scale=LOG_SCALE,
    measured="largest over initial amplitude in 20 steps", limit=1.05,
    method=MethodDefinition("genalpha", lambda rate: _overshoot(rate, "genalpha")),
    remedy=MethodDefinition("rodas4p2", lambda rate: _overshoot(rate, "rodas4p2")), reach=1e6,
    source="Hilber, Hughes, Earthquake Engineering and Structural Dynamics 6, 1978; Chung, "
    "Hulbert, Journal of Applied Mechanics 60, 1993",
)  # fmt: skip
