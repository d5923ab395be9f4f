"""Small scenes for the tests of results: each shows one thing."""

from __future__ import annotations

from typing import Any

import mstmm

GRAVITY = (0.0, -9.81, 0.0)


def rod(name: str, mass: float = 1.0) -> dict[str, Any]:
    """A uniform rod of 1 m along x, with a little inertia about itself and an end "tip"."""
    return {
        "name": name, "mass": mass, "center_of_mass": [0.5, 0, 0],
        "inertia": [0.001 * mass, mass / 12, mass / 12], "ends": {"tip": [1, 0, 0]},
    }  # fmt: skip


def pins(count: int, angles: list[float], **law: Any) -> mstmm.Scene:
    """A planar chain of rods on pins, from the ground."""
    hinges = [
        {
            "name": f"pin{i}", "type": "pin", "inboard": f"rod{i - 1}.tip" if i else "ground",
            "outboard": f"rod{i}", "initial": {"q": [angles[i]]}, "law": law,
        }
        for i in range(count)
    ]  # fmt: skip
    return mstmm.Scene(gravity=GRAVITY, body=[rod(f"rod{i}") for i in range(count)], hinge=hinges)


def motor(effort: str, speed: float = 0.0, **law: Any) -> mstmm.Scene:
    """One rod on a pin without gravity, driven by an effort."""
    hinge = {
        "name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod",
        "initial": {"q": [0.3], "u": [speed]}, "law": {"effort": effort, **law},
    }  # fmt: skip
    return mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod")], hinge=[hinge])


#: A skew tree with a hinge of every kind of law, a load, a spring, loads in body axes, a drive.
TREE = {
    "gravity": [1.0, -9.0, 3.0],
    "body": [
        {
            "name": "base", "mass": 5.0, "center_of_mass": [0.1, -0.05, 0.2],
            "inertia": [0.3, 0.4, 0.5, 0.01, -0.02, 0.03],
            "ends": {
                "left": {"position": [0.4, 0.1, 0], "orientation": [0.3, -0.4, 0.5]},
                "right": {"position": [-0.3, 0.2, 0.1], "orientation": [-0.6, 0.2, 0.1]},
            },
        },
        {
            "name": "arm", "mass": 1.5, "center_of_mass": [0.3, 0.02, -0.01],
            "inertia": [0.01, 0.05, 0.05, 0.001, 0.002, -0.001],
            "ends": {"tip": {"position": [0.6, 0, 0.1], "orientation": [0.1, 0.2, 0.3]}},
        },
        {
            "name": "paddle", "mass": 0.8, "center_of_mass": [0, 0.2, 0.1],
            "inertia": [0.02, 0.01, 0.015],
        },
        {
            "name": "wheel", "mass": 1.2, "center_of_mass": [0, 0, 0.1],
            "inertia": [0.02, 0.02, 0.03], "ends": {"rim": [0.2, 0, 0]},
        },
    ],
    "hinge": [
        {
            "name": "space", "type": "free", "inboard": "ground", "outboard": "base",
            "position": [0.2, 0.3, -0.1], "orientation": [0.2, 0.1, -0.4],
            "initial": {"q": [0.1, 0.2, 0.3, 0.9, 0.1, -0.2, 0.3],
                        "u": [0.3, -0.2, 0.1, 0.4, -0.5, 0.6]},
        },
        {
            "name": "elbow", "type": "universal", "inboard": "base.left", "outboard": "arm",
            "axis": [1, 0, 0.2], "axis2": [0, 1, 0], "orientation": [0.1, 0.2, -0.3],
            "initial": {"q": [0.4, -0.3], "u": [0.7, 0.5]},
            "law": {"stiffness": [3.0, 2.0], "damping": [0.2, 0.1]},
        },
        {
            "name": "wrist", "type": "ball", "inboard": "arm.tip", "outboard": "paddle",
            "initial": {"q": [0.9, 0.2, -0.3, 0.1], "u": [0.3, 0.9, -0.4]},
        },
        {
            "name": "slider", "type": "cylindrical",
            "inboard": "base.right", "outboard": "wheel.rim",
            "axis": [0, 1, 1], "initial": {"q": [0.1, 0.2], "u": [0.4, -0.6]},
            "law": {"effort": ["0.5*sin(3*t)", "0.2*cos(t)"]},
        },
    ],
    "load": [{"on": "arm.tip", "force": ["cos(2*t)", 0.5, 0], "axes": "body"}],
    "spring": [
        {"from": "ground", "to": "paddle", "position": [1, 1, 0],
         "law": {"stiffness": 8.0, "rest": 0.3, "damping": 0.4}},
    ],
}  # fmt: skip


def tree() -> mstmm.Scene:
    """The skew tree as a scene."""
    return mstmm.Scene.from_data(TREE)
