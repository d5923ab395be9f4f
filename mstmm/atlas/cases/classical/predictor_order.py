"""One solution per step of the classical method, expanded about the start of the step."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ....array_validation import Array
from ....runtime.integrate.methods import ClassicalDiscreteTime
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import double_pendulum
from ...variants import no_predictor

T_END, REFERENCE_STEPS = 0.2, 4


def _without_predictor(steps: int) -> Array:
    return no_predictor.final_coordinates(double_pendulum(), T_END / steps, steps)


def _with_predictor(steps: int) -> Array:
    method = ClassicalDiscreteTime(scheme="newmark")
    run = simulate_to_end(double_pendulum(), T_END, method, T_END / steps, output_times=[T_END])
    return run.q[-1]


@cache
def _exact() -> Array:
    return simulate_to_end(
        double_pendulum(), T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]
    ).q[-1]  # fmt: skip


def _error(end_of: Callable[[int], Array], steps: int) -> float:
    return float(np.abs(end_of(steps) - _exact()).max())


def _excess(steps: float, end_of: Callable[[int], Array]) -> float:
    """Error relative to second order: 1 as long as it falls with the square of the step."""
    return (
        _error(end_of, int(steps))
        / _error(end_of, REFERENCE_STEPS)
        * (steps / REFERENCE_STEPS) ** 2
    )


CASE = CaseDefinition(
    name="predictor-order",
    title="One solution per step: a predictor without motion",
    cause="Expanded about the start of a step, the hinge constraints omit the rotation of the "
    "hinge points within the step, an error of second order. Loads depend on the second difference "
    "of that error, and centripetal accelerations are wrong however short the steps are. A "
    "predictor with the accelerations has an error of third order. Second order is measured from "
    "four steps on.",
    parameter="steps in 0.2 s",
    unit="",
    low=REFERENCE_STEPS,
    high=1024,
    scale=COUNT_SCALE,
    measured="error over that of second order",
    limit=2.0,
    method=MethodDefinition(
        "newmark about y* = y", lambda steps: _excess(steps, _without_predictor)
    ),
    remedy=MethodDefinition(
        "newmark about y* = y + h yd + h² ydd/2", lambda steps: _excess(steps, _with_predictor)
    ),
    reach=4096,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Arnold, "
    "Bruls, Multibody System Dynamics 18, 2007",
)
