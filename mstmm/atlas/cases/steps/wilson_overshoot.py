"""Wilson's method in its first steps from a stretched spring."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import relative_amplitudes
from ...parameter_scale import LOG_SCALE

STEPS = 20


def _overshoot(rate: float, method: str) -> float:
    return float(relative_amplitudes(rate, STEPS, method).max())


CASE = CaseDefinition(
    name="wilson-overshoot",
    title="Wilson's method: overshoot in the first steps",
    cause="Wilson's method carries accelerations over and collocates after the end of the step. It "
    "is stable for any step, but in its first steps a stretched spring overshoots with the square "
    "of step times frequency. Nothing diverges, and still the results of the first instants are "
    "wrong by any factor. L-stable Rosenbrock methods damp the vibration at once.",
    parameter="step times angular frequency", unit="", low=0.1, high=1e5, scale=LOG_SCALE,
    measured="largest over initial amplitude in 20 steps", limit=1.05,
    method=MethodDefinition("wilson", lambda rate: _overshoot(rate, "wilson")),
    remedy=MethodDefinition("rodas4p2", lambda rate: _overshoot(rate, "rodas4p2")), reach=1e6,
    source="Goudreau, Taylor, Computer Methods in Applied Mechanics and Engineering 2, 1972; "
    "Hilber, Hughes, Earthquake Engineering and Structural Dynamics 6, 1978",
)  # fmt: skip
