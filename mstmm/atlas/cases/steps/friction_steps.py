"""Rosenbrock steps with sharper and sharper friction."""

from __future__ import annotations

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

STEP, REFERENCE_STEP, T_END = 0.01, 5e-4, 3.0
TIMES = np.linspace(0.0, T_END, 31)


def _path(velocity: float, method: str, step: float) -> Array:
    """Path (m) of 1 kg with friction of 1 N, pulled by 10 N/m whose end moves at 0.3 m/s."""
    law = {
        "effort": "10*(0.3*t - q)",
        "friction": {"coulomb": 1.0, "regularisation_velocity": velocity},
    }
    slide = {
        "name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "mass", "law": law,
    }  # fmt: skip
    mass = {"name": "mass", "mass": 1.0}
    mass_model = compile_looped({"gravity": [0, 0, 0], "body": [mass], "hinge": [slide]})
    return np.asarray(simulate_to_end(mass_model, T_END, method, step, output_times=TIMES).q[:, 0])


def _error(velocity: float, method: str) -> float:
    exact = _path(velocity, "esdirk436", REFERENCE_STEP)
    return float(np.abs(_path(velocity, method, STEP) - exact).max())


CASE = CaseDefinition(
    name="friction-steps",
    title="Linearised friction: a body that sticks and slips",
    cause="Rosenbrock methods linearise friction at the start of a step. A body that sticks has a "
    "slope there that vanishes as soon as it slips, but the step keeps it: the body sticks too "
    "long. Methods that iterate evaluate friction at the end of the step, until their iteration "
    "does not converge across the bend; then they report it.",
    parameter="velocity over which friction is regularised", unit="m/s", low=1e-7, high=0.1,
    scale=LOG_SCALE,
    measured="error of the displacement, m", limit=1e-4,
    method=MethodDefinition("rodas4p2, h = 10 ms", lambda velocity: _error(velocity, "rodas4p2")),
    remedy=MethodDefinition("esdirk436, h = 10 ms", lambda velocity: _error(velocity, "esdirk436")),
    reach=1e-7,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 and IV.8",
)  # fmt: skip
