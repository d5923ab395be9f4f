"""One solution per step of the classical method, expanded about the start of the step."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ....arrays import Array
from ...definition import Definition, Method
from ...measures import simulated
from ...scale import COUNT
from ...scenes import double_pendulum
from ...variants import held_places

T_END, FEW = 0.2, 4


def _held(steps: int) -> Array:
    return held_places.end_of(double_pendulum(), T_END / steps, steps)


def _kept(steps: int) -> Array:
    run = simulated(
        double_pendulum(), T_END, "dttmm-classical", T_END / steps, output_times=[T_END],
        scheme="newmark",
    )  # fmt: skip
    return run.q[-1]


@cache
def _exact() -> Array:
    return simulated(
        double_pendulum(), T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]
    ).q[-1]  # fmt: skip


def _error(end_of: Callable[[int], Array], steps: int) -> float:
    return float(np.abs(end_of(steps) - _exact()).max())


def _excess(steps: float, end_of: Callable[[int], Array]) -> float:
    """Error relative to second order: 1 as long as it falls with the square of the step."""
    return _error(end_of, int(steps)) / _error(end_of, FEW) * (steps / FEW) ** 2


CASE = Definition(
    name="predictor-order",
    title="One solution per step: a predictor without motion",
    why="Expanded about the start of a step, the hinge constraints omit the rotation of the "
    "hinge points within the step, an error of second order. Loads depend on the second difference "
    "of that error, and centripetal accelerations are wrong however short the steps are. A "
    "predictor with the accelerations has an error of third order. Second order is measured from "
    "four steps on.",
    parameter="steps in 0.2 s", unit="", low=FEW, high=1024, scale=COUNT,
    measured="error over that of second order", limit=2.0,
    method=Method("newmark about y* = y", lambda steps: _excess(steps, _held)),
    remedy=Method(
        "newmark about y* = y + h yd + h² ydd/2", lambda steps: _excess(steps, _kept)
    ), reach=4096,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 7; Arnold, "
    "Bruls, Multibody System Dynamics 18, 2007",
)  # fmt: skip
