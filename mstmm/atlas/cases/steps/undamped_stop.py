"""Fixed steps across a stop that gives back what it takes."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model

STEP, PHASES = 0.01, 40


def _rebound(rate: float, fixed: bool) -> float:
    """Energy with which 1 kg leaves a stop, of that with which it came at 1 m/s: the largest over
    PHASES places within a step at which it meets the stop."""
    stop = {"lower": 0.0, "stiffness": (rate / STEP) ** 2, "damping": 0.0}
    slide = {
        "name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "mass", "law": {"limits": stop},
    }  # fmt: skip
    mass = {"name": "mass", "mass": 1.0}
    falling = model({"gravity": [0, 0, 0], "body": [mass], "hinge": [slide]})
    t_end = STEP * round((np.pi / rate) + 8)
    speeds = []
    for phase in np.arange(PHASES) / PHASES:
        start = [STEP * (1 + phase)], [-1.0]
        settings = {"step": STEP} if fixed else {"rtol": 1e-6, "atol": 1e-9}
        run = simulated(falling, t_end, "genalpha", initial=start, **settings)
        speeds.append(float(run.u[-1, 0]))
    return max(speeds) ** 2


CASE = Definition(
    name="undamped-stop",
    title="Fixed steps across a stop without damping",
    why="A stop is a spring that begins all at once. Somewhere within a step it is met, the step "
    "takes it for there from its beginning or its end on, and what comes back is not what went in: "
    "according to the place more or less energy, the more the stiffer the stop. Steps under error "
    "control shrink until the contact is followed.",
    parameter="step times angular frequency on the stop", unit="", low=0.1, high=100.0, scale=LOG,
    measured="energy after the rebound, of that before", limit=1.05,
    method=Method("genalpha, fixed steps", lambda rate: _rebound(rate, True)),
    remedy=Method("genalpha, rtol = 1e-6", lambda rate: _rebound(rate, False)), reach=1e4,
    source="Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.6",
)  # fmt: skip
