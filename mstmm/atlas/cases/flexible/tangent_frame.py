"""Frame tangent to a beam at its pinned end, with more and more shapes."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import COUNT
from ...scenes import model

STEP, STEPS = 1e-3, 200


def _angle(shapes: float, frame: str) -> float:
    """Largest angle (rad) of the end of a beam of 1 m and 1 kg on a damped pin, from 1 rad/s."""
    beam = {
        "name": "beam", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": int(shapes)}, "frame": frame,
    }  # fmt: skip
    pin = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "beam",
        "law": {"damping": 1.0}, "initial": {"u": [1.0]},
    }  # fmt: skip
    turning = model({"gravity": [0, 0, 0], "beam": [beam], "hinge": [pin]})
    times = np.arange(STEPS + 1) * STEP
    run = simulated(turning, times[-1], "rk4", STEP, output_times=times)
    return float(np.abs(run.q[:, 0]).max())


CASE = Definition(
    name="tangent-frame",
    title="Frame tangent to a beam at a pinned end",
    why="Many clamped shapes together can nearly represent the rotation of a pinned beam without "
    "its frame. The inertia left for the frame falls with the third power of their number, and a "
    "damper in the pin then causes a motion faster than any of the beam. A chord frame, or the "
    "mean frame, has ten times more of the inertia.",
    parameter="shapes of a beam on a damped pin", unit="", low=1, high=20, scale=COUNT,
    measured="largest angle of the pinned end, rad", limit=1.0,
    method=Method("tangent frame, rk4 with h = 1 ms", lambda n: _angle(n, "tangent")),
    remedy=Method("mean frame, rk4 with h = 1 ms", lambda n: _angle(n, "mean")), reach=20,
    source="Schwertassek, Wallrapp, Shabana, Flexible multibody simulation and choice of shape "
    "functions, Nonlinear Dynamics 20 (1999), pp. 361-380",
)  # fmt: skip
