"""Force that is narrow along the motion, with error control."""

from __future__ import annotations

import math

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, rod

#: Position of the pulse, rad, and its work, J.
PULSE_ANGLE, PULSE_WORK = 5.0, 0.5


def _error(width: float, switched: bool) -> float:
    """Relative error of the final speed, which follows from the work of the pulse."""
    strength = PULSE_WORK / (width * math.sqrt(math.pi))
    effort = f"{strength!r}*exp(-((q - {PULSE_ANGLE})/{width!r})^2)"
    if switched:
        low, high = PULSE_ANGLE - 6 * width, PULSE_ANGLE + 6 * width
        effort = f"where(q > {low!r}, where(q < {high!r}, {effort}, 0), 0)"
    hinge = {
        "name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod",
        "law": {"effort": effort}, "initial": {"u": [1.0]},
    }  # fmt: skip
    rod_model = compile_looped({"gravity": [0, 0, 0], "body": [rod("rod")], "hinge": [hinge]})
    run = simulate_to_end(rod_model, 10.0, output_times=[10.0])
    inertia = float(rod_model.mass_matrix([0.0])[0, 0])
    return abs(float(run.u[-1, 0]) / math.sqrt(1 + 2 * PULSE_WORK / inertia) - 1)


CASE = CaseDefinition(
    name="narrow-pulse",
    title="Narrow pulses between the stages of a step",
    cause="A method evaluates a force only at the stages of its steps. In a uniform motion steps "
    "grow, and a smooth force that is narrow along the motion may be missed with all its work, "
    "while every estimated error is zero. Written with a comparison, the same force is located "
    "however narrow it is; max_step helps as well, at a cost.",
    parameter="width of the pulse", unit="rad", low=1e-4, high=1.0, scale=LOG_SCALE,
    measured="error of the speed after it, relative", limit=1e-6,
    method=MethodDefinition("dop853, rtol 1e-9", lambda width: _error(width, False)),
    remedy=MethodDefinition("dop853, the pulse within where()", lambda width: _error(width, True)),
    reach=1e-8,
    source="Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 1993, II.4",
)  # fmt: skip
