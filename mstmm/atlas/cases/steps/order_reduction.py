"""Rosenbrock steps with a stiff spring moved by a prescribed motion."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model

STEP = 0.05

#: Output times of the error, s, after the transient of the start.
TIMES = np.linspace(1.0, 2.0, 21)


def _error(stiffness: float, method: str) -> float:
    slide = {"type": "prismatic", "axis": [1, 0, 0]}
    law = {"stiffness": stiffness, "damping": 2 * float(np.sqrt(stiffness))}
    bodies = [{"name": "base", "mass": 1.0}, {"name": "mass", "mass": 1.0}]
    hinges = [
        {"name": "road", "inboard": "ground", "outboard": "base", "drive": "0.1*sin(3*t)", **slide},
        {"name": "spring", "inboard": "base", "outboard": "mass", "law": law, **slide},
    ]
    moved = model({"gravity": [0, 0, 0], "body": bodies, "hinge": hinges})
    fine = simulated(moved, 2.0, "rodas5p", rtol=1e-12, atol=1e-16, output_times=TIMES)
    run = simulated(moved, 2.0, method, STEP, output_times=TIMES)
    stretch = fine.q[:, 1]
    return float(np.abs(run.q[:, 1] - stretch).max() / np.abs(stretch).max())


CASE = Definition(
    name="order-reduction",
    title="Order reduction: a stiff spring moved by a drive",
    why="Where a stiff spring is moved from outside, the error of a stage is that of the moved "
    "base and not that of the motion. The table of fourth order is of second order here, and its "
    "error in the spring load a hundred times larger. Tables made for this case, such as Rodas4P2, "
    "keep their order.",
    parameter="stiffness of the spring (of 1 kg, critically damped)", unit="N/m",
    low=10.0, high=1e7, scale=LOG,
    measured="error of the spring's load, relative", limit=2e-6,
    method=Method("rodas4, h = 50 ms", lambda k: _error(k, "rodas4")),
    remedy=Method("rodas4p2, h = 50 ms", lambda k: _error(k, "rodas4p2")), reach=1e10,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, VI.4; Steinebach, "
    "in Progress in Differential-Algebraic Equations II, 2020",
)  # fmt: skip
