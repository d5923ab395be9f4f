"""Method that is A-stable but keeps unresolved vibrations."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import STEP, relative_amplitudes
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import RELEASE_ANGLE, rod_with_spring, stiffness_for_frequency
from ...variants import ros3p
from ...variants.bare_rosenbrock import BareRosenbrock

#: Step times angular frequency.
RATE = 1e4


def _remaining_ros3p(steps: float) -> float:
    count, rate = max(1, round(steps)), RATE / STEP
    rod = rod_with_spring(stiffness_for_frequency(rate))
    q, u, _ = BareRosenbrock(rod, ros3p.tableau()).fixed_step_states(STEP, count)[-1]
    return float(np.hypot(q[0], u[0] / rate) / RELEASE_ANGLE)


def _remaining_rodas4p2(steps: float) -> float:
    return float(relative_amplitudes(RATE, max(1, round(steps)), "rodas4p2")[-1])


CASE = CaseDefinition(
    name="lasting-vibration",
    title="A-stable but not L-stable: unresolved vibration remains",
    cause="A method may be stable for any stiffness and still keep most of a vibration far too "
    "fast for its steps. This one keeps three quarters of it per step, and over about the first "
    "ten steps the vibration hides all other motion. The methods of a run keep next to nothing "
    "(they are L-stable, or damp by a chosen radius).",
    parameter="steps after the start", unit="", low=1.0, high=100.0, scale=LOG_SCALE,
    measured="remaining amplitude, relative to the start", limit=0.01,
    method=MethodDefinition("ros3p, step times frequency 1e4", _remaining_ros3p),
    remedy=MethodDefinition("rodas4p2", _remaining_rodas4p2), reach=1.0,
    source="Lang, Verwer, BIT 41, 2001; Hairer, Wanner, Solving Ordinary Differential Equations "
    "II, 1996, IV.3",
)  # fmt: skip
