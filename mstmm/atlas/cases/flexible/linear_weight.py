"""A linear beam that falls from a pin, in a tangent frame, beside a rigid one."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ....arrays import Array
from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model

T_END, GRAVITY = 1.0, 9.81


def _tip(weight: float, level: str | None = None, rtol: float = 1e-6, **of_beam: Any) -> Array:
    """(n, 2) Path of the tip of a beam of 1 m and 1 kg of this weight, in EI/L2; m."""
    fallen = {
        "name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": GRAVITY / weight,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    run = simulated(
        model(
            {"gravity": [0, -GRAVITY, 0], "beam": [fallen | of_beam], "hinge": [pin]},
            flexibility=level,
        ),
        T_END, "rodas5p", rtol=rtol, atol=rtol / 100, output_times=np.linspace(0, T_END, 101),
    )  # fmt: skip
    return np.asarray(run.position("rod.tip")[:, :2])


@cache
def _known(weight: float) -> tuple[Array, float]:
    """The path by more shapes in a frame that moves with them, and how far that of a rigid rod is
    from it at most (m)."""
    exact = _tip(weight, rtol=1e-8, frame="mean", modes={"y": 6})
    rigid = _tip(weight, "rigid", modes={"y": 6})
    return exact, float(np.abs(rigid - exact).max())


def _error(weight: float, stiffening: bool) -> float:
    exact, of_rigid = _known(weight)
    found = _tip(weight, frame="tangent", modes={"y": 2}, stiffening=stiffening)
    return float(np.abs(found - exact).max()) / of_rigid


CASE = Definition(
    name="linear-weight",
    title="Linear beam under its weight: worse than a rigid one",
    why="In the axes of a pinned end a falling beam is held by its bending alone, and its weight "
    "and the centrifugal force act on it bent. Linear equations leave out that the force along "
    "the beam stiffens it as it swings, and what they add to a rigid rod is then worse than "
    "nothing.",
    parameter="weight, in EI/L²", unit="", low=0.1, high=5.0, scale=LOG,
    measured="error of the tip's path in 1 s, of a rigid rod's", limit=1.0,
    method=Method("stiffening = false, 2 shapes", lambda weight: _error(weight, False)),
    remedy=Method("stiffening = true, 2 shapes", lambda weight: _error(weight, True)), reach=6.0,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Sharf, "
    "Multibody System Dynamics 3, 1999",
)  # fmt: skip
