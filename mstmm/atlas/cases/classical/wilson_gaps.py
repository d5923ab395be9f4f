"""Gaps of hinges between absolute coordinates with Wilson's method."""

from __future__ import annotations

import numpy as np

from ....runtime.classical.integration_schemes import parse_scheme
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import double_pendulum
from ...variants.classical_stepper import ClassicalSteps

T_END, ITERATIONS = 1.0, 20


def _largest_gap(step: float, scheme: str) -> float:
    """Largest gap, m, in the pins of two falling rods of 1 m."""
    run, largest = ClassicalSteps(double_pendulum(), parse_scheme(scheme), ITERATIONS), 0.0
    for _ in range(round(T_END / step)):
        run.advance(step)
        upper, lower = run.part_movements()
        elbow = upper.position + upper.axes[:, :, 0]
        largest = max(largest, *np.abs([upper.position, lower.position - elbow]).max(axis=(1, 2)))
    return largest


CASE = CaseDefinition(
    name="wilson-gaps",
    title="Wilson's method in absolute coordinates: hinges that open",
    cause="Wilson's collocation satisfies the equations, and with them the constraints, after the "
    "end of the step. The hinges are closed there, but not at the end of the step to which the "
    "method returns. However far a step is iterated, the gaps are of fourth order in the step. "
    "Schemes that satisfy the constraints at the end of the step close them to rounding.",
    parameter="length of a step", unit="s", low=2e-3, high=0.1, scale=LOG_SCALE,
    measured="largest gap in 1 s, m", limit=1e-6,
    method=MethodDefinition("wilson, iterated", lambda step: _largest_gap(step, "wilson")),
    remedy=MethodDefinition(
        "generalised-alpha:0.8, iterated", lambda step: _largest_gap(step, "generalised-alpha:0.8")
    ),
    reach=0.1,
    source="Wilson, Farhoomand, Bathe, Earthquake Engineering and Structural Dynamics 1, 1973; "
    "method: Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7",
)  # fmt: skip
