"""A Rosenbrock method whose tangent knows of laws alone."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import growth
from ...scale import LOG
from ...scenes import LET_GO, model, rod

STEP, STEPS = 0.01, 400


def _hanging(weight: float) -> dict[str, object]:
    pin = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
        "initial": {"q": [LET_GO]},
    }  # fmt: skip
    return {"gravity": [weight, 0, 0], "body": [rod("rod")], "hinge": [pin]}


def _growth(rate: float, tangent: str) -> float:
    """`rate` is the step times the angular frequency of a rod that hangs still."""
    still = model(_hanging(1.0))
    slope = float(still.derivatives(np.zeros(1), np.zeros(1)).q[0, 0])
    swinging = model(_hanging((rate / STEP) ** 2 / -slope))
    return growth(swinging, STEP, STEPS, "ros34pw2", tangent=tangent)


CASE = Definition(
    name="laws-tangent",
    title="A tangent of laws alone: stiffness that loads make",
    why="Weight, spin and preload make a motion stiff without any spring. A linearisation that "
    "takes the slopes of springs and dampers alone does not see it; a method of Rosenbrock's kind "
    "is then an explicit one in that direction. The exact tangent knows it.",
    parameter="step times angular frequency of a hanging rod", unit="", low=0.03, high=100.0,
    scale=LOG,
    measured="largest angle in 400 steps, of the start's", limit=1.01,
    method=Method("ros34pw2, tangent of laws", lambda rate: _growth(rate, "laws")),
    remedy=Method("ros34pw2, exact tangent", lambda rate: _growth(rate, "exact")), reach=1e3,
    source="Rang, Angermann, BIT 45, 2005 (W-methods); Hairer, Wanner, Solving Ordinary "
    "Differential Equations II, 1996, IV.7",
)  # fmt: skip
