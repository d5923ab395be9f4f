"""Implicit fixed steps of an unstable motion."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model, rod

STEP, AWAY = 0.01, 1e-9

#: Duration of a run, in time constants of growth.
GROWTHS = 8.0


def _standing(weight: float) -> dict[str, object]:
    pin = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
        "initial": {"q": [AWAY]},
    }  # fmt: skip
    return {"gravity": [-weight, 0, 0], "body": [rod("rod")], "hinge": [pin]}


def _error(rate: float, fixed: bool) -> float:
    """Relative error; `rate` is the step times the growth rate of an inverted rod on its pin."""
    still = model(_standing(1.0))
    slope = float(still.derivatives(np.zeros(1), np.zeros(1)).q[0, 0])
    falling = model(_standing((rate / STEP) ** 2 / slope))
    t_end = max(1, round(GROWTHS / rate)) * STEP
    exact = simulated(falling, t_end, rtol=1e-11, atol=1e-22, output_times=[t_end]).q
    if fixed:
        found = simulated(falling, t_end, "genalpha", STEP, output_times=[t_end]).q
    else:
        found = simulated(
            falling, t_end, "rodas4p2", rtol=1e-5, atol=1e-7 * AWAY, output_times=[t_end]
        ).q
    return abs(float(found[-1, 0] / exact[-1, 0]) - 1)


CASE = Definition(
    name="unstable-motion",
    title="Implicit steps: an unstable motion",
    why="Implicit steps damp fast motion, including fast growth. For an inverted or buckled body "
    "a step of half the time constant of growth is inaccurate. At twice that time the matrix of "
    "the step changes its sign: the run reports this and ends. The error of the step shows it, but "
    "fixed steps do not use it.",
    parameter="step times rate of growth", unit="", low=0.01, high=8.0, scale=LOG,
    measured="error of the displacement, relative", limit=0.1,
    method=Method("genalpha, h = 10 ms", lambda rate: _error(rate, True)),
    remedy=Method("rodas4p2, rtol 1e-5", lambda rate: _error(rate, False)), reach=8.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.3",
)  # fmt: skip
