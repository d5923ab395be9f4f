"""Explicit Runge-Kutta steps of a beam with more and more shapes."""

from __future__ import annotations

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import compile_looped

STEP, T_END = 1e-3, 0.2


def _deflection(shapes: float, method: str) -> float:
    """Largest tip deflection (m) of a clamped beam of 1 m under its weight, from straight."""
    beam = {
        "name": "beam", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
        "modes": {"y": int(shapes)}, "stiffening": False,
    }  # fmt: skip
    wall = {"name": "wall", "type": "fixed", "inboard": "ground", "outboard": "beam"}
    beam_model = compile_looped({"gravity": [0, -9.81, 0], "beam": [beam], "hinge": [wall]})
    run = simulate_to_end(beam_model, T_END, method, STEP)
    return float(np.abs(run.deflection("beam", "tip")[:, 1]).max())


CASE = CaseDefinition(
    name="rk4-shapes",
    title="Explicit steps: number of shapes of a beam",
    cause="Frequencies of shapes grow with the square of their number, and an explicit step must "
    "resolve the highest, even if the motion is that of the first. Use few suitable shapes, or "
    "implicit steps, which damp what they do not resolve.",
    parameter="shapes of a clamped beam", unit="", low=1, high=20, scale=COUNT_SCALE,
    measured="largest tip deflection over the length", limit=0.1,
    method=MethodDefinition("rk4, h = 1 ms", lambda n: _deflection(n, "rk4")),
    remedy=MethodDefinition("rodas4p2, h = 1 ms", lambda n: _deflection(n, "rodas4p2")), reach=20,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.2; shapes: Rao, "
    "Vibration of Continuous Systems, 2019, ch. 11",
)  # fmt: skip
