"""Scenes to look at, compiled and run once."""

from __future__ import annotations

from functools import cache
from typing import Any

import mstmm
from mstmm.runtime.result.result import Result

#: A beam on a pin with a ball and a hub behind it, a spring and shapes.
SCENE: dict[str, Any] = {
    "gravity": [0, 0, -9.81],
    "beam": [{
        "name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": [20.0, 40.0],
        "modes": {"y": 1, "z": 2},
    }],
    "body": [
        {"name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0],
         "inertia": [0.001, 0.0833, 0.0833], "ends": {"tip": [1, 0, 0], "ear": [0.5, 0.3, 0]}},
        {"name": "hub", "mass": 2.0, "inertia": [0.05, 0.06, 0.07]},
    ],
    "hinge": [
        {"name": "root", "type": "pin", "axis": [0, 1, 0], "inboard": "ground",
         "outboard": "blade", "initial": {"q": [0.4], "u": [0.3]}},
        {"name": "elbow", "type": "ball", "inboard": "blade.tip", "outboard": "rod",
         "initial": {"u": [0.5, 0, 2.0]}},
        {"name": "wrist", "type": "fixed", "inboard": "rod.tip", "outboard": "hub"},
    ],
    "spring": [{"name": "coil", "from": "ground", "to": "rod.ear", "position": [0, 0, 1],
                "law": {"stiffness": 5.0, "rest": 1.0}}],
    "shape": [
        {"name": "case", "on": "hub", "type": "box", "size": [0.2, 0.3, 0.4],
         "position": [0, 0, 0.1], "color": "#AA3322"},
        {"name": "floor", "on": "ground", "type": "cylinder", "radius": 0.3, "length": 0.05},
    ],
}  # fmt: skip


@cache
def model() -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**SCENE), engine="looped")


@cache
def run() -> Result:
    """Two seconds of it, sampled often enough to look between."""
    return model().simulate(2.0, output_times=[0.01 * k for k in range(201)])
