"""Linear beam in a tangent frame that falls from a pin, compared with a rigid one."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from ....array_validation import Array
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped

T_END, GRAVITY = 1.0, 9.81


def _tip(weight: float, level: str | None = None, rtol: float = 1e-6, **of_beam: Any) -> Array:
    """Path (n, 2), m, of the tip of a beam of 1 m and 1 kg with this weight, in EI/L^2."""
    beam = {
        "name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": GRAVITY / weight,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}
    run = simulate_to_end(
        compile_looped(
            {"gravity": [0, -GRAVITY, 0], "beam": [beam | of_beam], "hinge": [pin]},
            flexibility=level,
        ),
        T_END, "rodas5p", rtol=rtol, atol=rtol / 100, output_times=np.linspace(0, T_END, 101),
    )  # fmt: skip
    return np.asarray(run.position("rod.tip")[:, :2])


@cache
def _exact_path(weight: float) -> tuple[Array, float]:
    """Exact path, by more shapes in the mean frame, and the largest error of a rigid rod (m)."""
    exact = _tip(weight, rtol=1e-8, frame="mean", modes={"y": 6})
    rigid = _tip(weight, "rigid", modes={"y": 6})
    return exact, float(np.abs(rigid - exact).max())


def _error(weight: float, stiffening: bool) -> float:
    exact, rigid_error = _exact_path(weight)
    path = _tip(weight, frame="tangent", modes={"y": 2}, stiffening=stiffening)
    return float(np.abs(path - exact).max()) / rigid_error


CASE = CaseDefinition(
    name="linear-weight",
    title="Linear beam under its weight: worse than a rigid one",
    cause="In the axes of a pinned end only the bending stiffness of a falling beam opposes its "
    "weight and the centrifugal force. Linear equations neglect that the force along the beam "
    "stiffens it as it swings. Their correction of a rigid rod is then worse than none.",
    parameter="weight, in EI/L²",
    unit="",
    low=0.1,
    high=5.0,
    scale=LOG_SCALE,
    measured="tip path error in 1 s over that of a rigid rod",
    limit=1.0,
    method=MethodDefinition("stiffening = false, 2 shapes", lambda weight: _error(weight, False)),
    remedy=MethodDefinition("stiffening = true, 2 shapes", lambda weight: _error(weight, True)),
    reach=6.0,
    source="Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10, 1987; Sharf, "
    "Multibody System Dynamics 3, 1999",
)
