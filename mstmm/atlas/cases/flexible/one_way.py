"""Beam that responds to the motion of its hub without acting on the hub."""

from __future__ import annotations

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

#: Inertia of the beam, 1 m and 1 kg, about the hub (kg*m2); duration of the torque (s).
BEAM_INERTIA, PULSE_DURATION = 1 / 3, 3.6

TIMES = np.linspace(0.0, 2 * PULSE_DURATION, 101)


def _tip_path(hub: float, level: str, shapes: int) -> tuple[Array, float]:
    """Path of the tip and its largest deflection, m, under a torque of one period."""
    torque = 0.02 * (hub + BEAM_INERTIA)
    center = {"name": "hub", "mass": 1.0, "inertia": [hub] * 3}
    arm = {
        "name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
        "modes": {"y": shapes},
    }  # fmt: skip
    law = {"effort": f"where(t < {PULSE_DURATION}, {torque!r}*sin(2*pi*t/{PULSE_DURATION}), 0)"}
    hinges = [
        {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "hub", "law": law},
        {"name": "weld", "type": "fixed", "inboard": "hub", "outboard": "arm"},
    ]
    hub_model = compile_looped(
        {"gravity": [0, 0, 0], "body": [center], "beam": [arm], "hinge": hinges}, flexibility=level
    )
    run = simulate_to_end(hub_model, TIMES[-1], rtol=1e-8, atol=1e-10, output_times=TIMES)
    return run.position("arm.tip"), float(np.abs(run.deflection("arm", "tip")).max())


def _error(ratio: float, level: str) -> float:
    exact, deflection = _tip_path(ratio * BEAM_INERTIA, "coupled", 6)
    return float(np.abs(_tip_path(ratio * BEAM_INERTIA, level, 3)[0] - exact).max()) / deflection


CASE = CaseDefinition(
    name="one-way",
    title="One-way coupling: a beam that does not act on its hub",
    cause="A beam that only responds to the motion of a rigid run costs next to nothing, and is "
    "accurate as long as the body that carries it is heavy. Otherwise the hub moves with the "
    "vibration, which changes its frequency and size, and the response may be worse than none.",
    parameter="inertia of the hub over that of the beam",
    unit="",
    low=0.1,
    high=1e3,
    scale=LOG_SCALE,
    measured="error of the tip, relative to its deflection",
    limit=0.1,
    method=MethodDefinition("one-way, 3 shapes", lambda ratio: _error(ratio, "one-way")),
    remedy=MethodDefinition("coupled, 3 shapes", lambda ratio: _error(ratio, "coupled")),
    reach=0.1,
    source="Shabana, Dynamics of Multibody Systems, 2020, ch. 5 (linear theory of elastodynamics)",
)
