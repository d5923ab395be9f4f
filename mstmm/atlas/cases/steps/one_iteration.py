"""One linearised equation per step with a stiff spring stretched at the start."""

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
    name="one-iteration",
    title="One linearised equation per step: an unresolved stiff motion",
    cause="Where a bushing is stretched at the start, its end moves far within a step, and an "
    "expansion about the predicted motion is inaccurate: the energy grows without a source. "
    "Iterating to convergence, the remedy, holds as long as the iteration converges.",
    parameter="stiffness of bushings (stretched by 1 mm)",
    unit="N/m",
    low=1e3,
    high=1e9,
    scale=LOG_SCALE,
    measured="largest energy in 2 s over that exchanged",
    limit=1.05,
    method=MethodDefinition("dttmm, h = 10 ms", lambda k: _relative_energy(k, "dttmm")),
    remedy=MethodDefinition("genalpha, iterated", lambda k: _relative_energy(k, "genalpha")),
    reach=1e9,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Negrut, "
    "Jay, Khude, Journal of Computational and Nonlinear Dynamics 4, 2009",
)
