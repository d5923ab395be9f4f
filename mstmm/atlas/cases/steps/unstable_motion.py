"""Implicit fixed steps where a motion leaves by itself."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model, rod

STEP, AWAY = 0.01, 1e-9

#: Length of a run, in times of growth by e.
GROWTHS = 8.0


def _standing(weight: float) -> dict[str, object]:
    pin = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
        "initial": {"q": [AWAY]},
    }  # fmt: skip
    return {"gravity": [-weight, 0, 0], "body": [rod("rod")], "hinge": [pin]}


def _error(rate: float, fixed: bool) -> float:
    """`rate` is the step times the rate at which a rod that stands on its pin falls."""
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
    title="Implicit steps: a motion that leaves by itself",
    why="Implicit steps forget what is fast, and what grows fast with it. Beside an inverted or "
    "buckled body a step of half the time of growth is wrong, and at twice that time the matrix "
    "of the step loses its sign: the run says so and ends. The error of the step knows; only steps "
    "that are fixed do not heed it.",
    parameter="step times rate of growth", unit="", low=0.01, high=8.0, scale=LOG,
    measured="error of the way, relative", limit=0.1,
    method=Method("genalpha, h = 10 ms", lambda rate: _error(rate, True)),
    remedy=Method("rodas4p2, rtol 1e-5", lambda rate: _error(rate, False)), reach=8.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.3",
)  # fmt: skip
