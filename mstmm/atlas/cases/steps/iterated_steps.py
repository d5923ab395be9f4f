"""Iterated steps with a very stiff spring that is stretched at the start."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import energy_gain, simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import FALL_ENERGY, double_pendulum

STEP, STRETCH = 0.01, 1e-3


def _relative_energy(stiffness: float, method: str) -> float:
    return energy_gain(
        simulate_to_end(double_pendulum(stiffness, STRETCH), 2.0, method, STEP), FALL_ENERGY
    )


CASE = CaseDefinition(
    name="iterated-steps",
    title="Iterated steps: a stiff spring with much energy",
    cause="Generalised-alpha carries the accelerations of the start over. Those of a stretched "
    "spring may be thousands of times those of the motion, and then even converged steps give the "
    "bodies a wrong motion. Rodas4P2 is L-stable in every stage: it damps the unresolved "
    "vibration, and with it the energy of the spring.",
    parameter="stiffness of bushings (stretched by 1 mm)",
    unit="N/m",
    low=1e3,
    high=1e9,
    scale=LOG_SCALE,
    measured="largest energy in 2 s over that exchanged",
    limit=1.05,
    method=MethodDefinition("genalpha, h = 10 ms", lambda k: _relative_energy(k, "genalpha")),
    remedy=MethodDefinition("rodas4p2, h = 10 ms", lambda k: _relative_energy(k, "rodas4p2")),
    reach=1e10,
    source="Chung, Hulbert, Journal of Applied Mechanics 60, 1993; Steinebach, in Progress in "
    "Differential-Algebraic Equations II, 2020",
)
