"""Springs and dampers that hold closed loops together."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ....runtime.engine.loops.calls import LoopCalls
from ....runtime.model.model import Model
from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import model
from ...variants import baumgarte

STEP, STEPS = 5e-3, 300


@cache
def _four_bar() -> Model:
    """A crank of 0.5 m at 6 rad/s, a coupler of 1.1 m, a rocker of 0.8 m, feet 1.2 m apart."""

    def rod(name: str, length: float) -> dict[str, Any]:
        across = length**3 / 12
        return {
            "name": name, "mass": length, "center_of_mass": [length / 2, 0, 0],
            "inertia": [1e-3 * length, across, across], "ends": {"tip": [length, 0, 0]},
        }  # fmt: skip

    def pin(name: str, inboard: str, outboard: str, angle: float) -> dict[str, Any]:
        return {
            "name": name, "type": "pin", "inboard": inboard, "outboard": outboard,
            "initial": {"q": [angle]},
        }  # fmt: skip

    foot = pin("foot", "ground", "crank", 1.0) | {"initial": {"q": [1.0], "u": [6.0]}, "hold": True}
    return model({
        "gravity": [0, -9.81, 0],
        "body": [rod("crank", 0.5), rod("coupler", 1.1), rod("rocker", 0.8)],
        "hinge": [
            foot, pin("knee", "crank.tip", "coupler", -0.6),
            pin("heel", "ground", "rocker", 1.7) | {"position": [1.2, 0, 0]},
            pin("top", "coupler.tip", "rocker.tip", 0.0),
        ],
    })  # fmt: skip


def _stabilised(rate: float) -> float:
    return baumgarte.gap_of(_four_bar(), STEP, STEPS, rate / STEP)


@cache
def _projected() -> float:
    linkage = _four_bar()
    times = STEP * np.arange(STEPS + 1)
    run = simulated(linkage, times[-1], "rk4", STEP, output_times=times)
    calls, still = LoopCalls(linkage.looped, run.q[0]), np.zeros(linkage.nu)
    return max(float(np.abs(calls.correction(calls.gap, q, still)[1]).max()) for q in run.q)


CASE = Definition(
    name="baumgarte",
    title="Closed loops held by springs and dampers: a four-bar",
    why="Accelerations that keep a loop closed leave its gap to the errors of the steps, and it "
    "opens. Baumgarte lets a spring and a damper close it, with a rate that somebody chooses: "
    "a low one does little, and a high one makes the equations stiff for nothing, until the steps "
    "are too long for it. Projecting positions and speeds after each step has no such number, and "
    "leaves rounding.",
    parameter="rate of the springs times step", unit="", low=0.05, high=10.0, scale=LOG,
    measured="largest gap in 1.5 s, m or rad", limit=1e-3,
    method=Method("rk4, h = 5 ms, Baumgarte's rates", _stabilised),
    remedy=Method("rk4, h = 5 ms, projection", lambda rate: _projected()), reach=10.0,
    source="Baumgarte, Computer Methods in Applied Mechanics and Engineering 1, 1972; Hairer, "
    "Lubich, Wanner, Geometric Numerical Integration, 2006, IV.4",
)  # fmt: skip
