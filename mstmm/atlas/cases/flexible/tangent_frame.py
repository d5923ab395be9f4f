"""A frame tangent to a beam at its pinned end, with ever more shapes."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import COUNT
from ...scenes import model

STEP, STEPS = 1e-3, 200


def _angle(shapes: float, frame: str) -> float:
    """Largest angle of the end of a beam of 1 m and 1 kg that turns at 1 rad/s against a damper in
    its pin, rad."""
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
    title="A frame tangent to a beam at a pinned end",
    why="Many shapes of a clamped beam together can all but turn a pinned one without its frame: "
    "what is left for the frame to carry falls with the third power of their number, and "
    "what damps the pin makes a motion of it that is faster than any of the beam. A chord, or the "
    "mean of the beam, leaves the frame ten times more of the inertia.",
    parameter="shapes of a beam on a damped pin", unit="", low=1, high=20, scale=COUNT,
    measured="largest angle of the pinned end, rad", limit=1.0,
    method=Method("tangent frame, rk4 with h = 1 ms", lambda n: _angle(n, "tangent")),
    remedy=Method("mean frame, rk4 with h = 1 ms", lambda n: _angle(n, "mean")), reach=20,
    source="Schwertassek, Wallrapp, Shabana, Flexible multibody simulation and choice of shape "
    "functions, Nonlinear Dynamics 20 (1999), pp. 361-380",
)  # fmt: skip
