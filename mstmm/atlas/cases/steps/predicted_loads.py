"""One linearised equation per step with stiff springs, about predicted loads."""

from __future__ import annotations

from ....runtime.integrate.methods import ClassicalDiscreteTime, Method
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import energy_gain, simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import FALL_ENERGY, double_pendulum

STEP = 0.01


def _relative_energy(stiffness: float, method: str | Method) -> float:
    run = simulate_to_end(double_pendulum(stiffness), 1.0, method, STEP)
    return energy_gain(run, FALL_ENERGY)


CASE = CaseDefinition(
    name="predicted-loads",
    title="One linearised equation per step: rotation of predicted loads",
    cause="A predictor has an error of third order in the length of a spring, and the load there "
    "has that error times the stiffness. The rotation of loads with their bodies is linearised "
    "about this load. Slack springs carry some 40 N, but the predicted load is of the order of "
    "meganewtons, and it disturbs the next step as well. Runs stop at the pivot that changes its "
    "sign. The classical form in absolute coordinates, with damping, rotates only the loads that "
    "the springs had before.",
    parameter="stiffness of bushings (slack at the start)", unit="N/m", low=1e3, high=1e9,
    scale=LOG_SCALE, measured="largest energy in 1 s over that exchanged", limit=1.05,
    method=MethodDefinition("dttmm, h = 10 ms", lambda k: _relative_energy(k, "dttmm")),
    remedy=MethodDefinition(
        "dttmm-classical, generalised-alpha:0.8",
        lambda k: _relative_energy(k, ClassicalDiscreteTime(scheme="generalised-alpha:0.8")),
    ), reach=1e12,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Negrut, "
    "Jay, Khude, Journal of Computational and Nonlinear Dynamics 4, 2009",
)  # fmt: skip
