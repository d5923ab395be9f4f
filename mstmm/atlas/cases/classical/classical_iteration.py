"""One linear solution per step of the classical method, with a stretched stiff spring."""

from __future__ import annotations

from ....runtime.integrate.methods import ClassicalDiscreteTime
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import energy_gain, simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import FALL_ENERGY, double_pendulum

STEP, STRETCH = 0.01, 1e-3


def _relative_energy(stiffness: float, scheme: str, iterations: int = 1) -> float:
    model = double_pendulum(stiffness, STRETCH)
    method = ClassicalDiscreteTime(scheme=scheme, iterations=iterations)
    return energy_gain(simulate_to_end(model, 2.0, method, STEP), FALL_ENERGY)


CASE = CaseDefinition(
    name="classical-iteration",
    title="Classical method, one solution per step: unresolved stiff motion",
    cause="The trapezoidal rule in absolute coordinates with one linear solution per step moves "
    "the bodies by the error of the first solution. A scheme that damps fast motion, iterated, "
    "holds up to about a hundred times that stiffness.",
    parameter="stiffness of bushings (stretched by 1 mm)",
    unit="N/m",
    low=1e3,
    high=1e9,
    scale=LOG_SCALE,
    measured="largest energy in 2 s over that exchanged",
    limit=1.05,
    method=MethodDefinition(
        "dttmm-classical, newmark, one solution", lambda k: _relative_energy(k, "newmark")
    ),
    remedy=MethodDefinition(
        "generalised-alpha:0.8, iterated",
        lambda k: _relative_energy(k, "generalised-alpha:0.8", 20),
    ),
    reach=1e9,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7",
)
