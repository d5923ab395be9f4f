"""Undamped Newmark on absolute coordinates, in longer and longer runs."""

from __future__ import annotations

import numpy as np

from ....runtime.integrate.methods import ClassicalDiscreteTime
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import double_pendulum

STEP = 0.01


def _energy_change(t_end: float, scheme: str) -> float:
    steps = max(1, round(t_end / STEP))
    method = ClassicalDiscreteTime(scheme=scheme)
    run = simulate_to_end(double_pendulum(), steps * STEP, method, STEP)
    energy = np.asarray(run.energy())
    exchanged = np.ptp(np.asarray(run.quantity("energy.kinetic").values))
    return float(np.abs(energy - energy[0]).max() / exchanged)


CASE = CaseDefinition(
    name="newmark-constraints",
    title="Undamped Newmark in absolute coordinates: length of a run",
    cause="Where hinges are constraints at position level, their loads follow the second "
    "difference of positions. The trapezoidal rule keeps every other error of these loads: they "
    "oscillate, grow slowly and then explode, however far the steps are iterated. Schemes that "
    "damp infinitely fast motion avoid this, and hinge coordinates have no such loads.",
    parameter="length of the run",
    unit="s",
    low=0.5,
    high=30.0,
    scale=LOG_SCALE,
    measured="change of the energy over that exchanged",
    limit=0.1,
    method=MethodDefinition(
        "dttmm-classical, newmark, h = 10 ms", lambda t: _energy_change(t, "newmark")
    ),
    remedy=MethodDefinition(
        "dttmm-classical, generalised-alpha:0.8",
        lambda t: _energy_change(t, "generalised-alpha:0.8"),
    ),
    reach=60.0,
    source="Cardona, Geradin, Computers and Structures 33, 1989; method: Rui, Wang, Zhang, "
    "Transfer Matrix Method for Multibody Systems, 2019, ch. 7",
)
