"""Frame tangent to a beam at its pinned end, with more and more shapes."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import compile_looped

STEP, STEPS = 1e-3, 200


def _largest_angle(shapes: float, frame: str) -> float:
    """Largest angle (rad) of the end of a beam of 1 m and 1 kg on a damped pin, from 1 rad/s."""
    beam = {
        "name": "beam", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": int(shapes)}, "frame": frame,
    }  # fmt: skip
    pin = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "beam",
        "law": {"damping": 1.0}, "initial": {"u": [1.0]},
    }  # fmt: skip
    beam_model = compile_looped({"gravity": [0, 0, 0], "beam": [beam], "hinge": [pin]})
    times = np.arange(STEPS + 1) * STEP
    run = simulate_to_end(beam_model, times[-1], "rk4", STEP, output_times=times)
    return float(np.abs(run.q[:, 0]).max())


CASE = CaseDefinition(
    name="tangent-frame",
    title="Frame tangent to a beam at a pinned end",
    cause="Many clamped shapes together can nearly represent the rotation of a pinned beam without "
    "its frame. The inertia left for the frame falls with the third power of their number, and a "
    "damper in the pin then causes a motion faster than any of the beam. A chord frame, or the "
    "mean frame, has ten times more of the inertia.",
    parameter="shapes of a beam on a damped pin",
    unit="",
    low=1,
    high=20,
    scale=COUNT_SCALE,
    measured="largest angle of the pinned end, rad",
    limit=1.0,
    method=MethodDefinition(
        "tangent frame, rk4 with h = 1 ms", lambda n: _largest_angle(n, "tangent")
    ),
    remedy=MethodDefinition("mean frame, rk4 with h = 1 ms", lambda n: _largest_angle(n, "mean")),
    reach=20,
    source="Schwertassek, Wallrapp, Shabana, Flexible multibody simulation and choice of shape "
    "functions, Nonlinear Dynamics 20 (1999), pp. 361-380",
)
