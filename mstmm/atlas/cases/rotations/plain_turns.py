"""Finite rotations added like small ones, in steps of the classical method."""

from __future__ import annotations

from functools import cache

import numpy as np

from ....array_validation import Array
from ....runtime.integrate.methods import ClassicalDiscreteTime
from ....runtime.model.model import Model
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import ROD_TRANSVERSE_INERTIA, compile_looped, rod
from ...variants import additive_rotations

T_END, SPIN, RADIUS = 1.0, 6.0, 0.8


@cache
def _two_rods() -> Model:
    """Two falling rods on ball hinges; the first spins about its axis, the second across it."""
    spins = ([SPIN, 0, 0], [0, 0, SPIN / 2])
    hinge_ends = (("shoulder", "ground", "upper"), ("elbow", "upper.tip", "lower"))
    return compile_looped(
        {
            "gravity": [0, -9.81, 0],
            "body": [
                rod(name, inertia=(0.01, ROD_TRANSVERSE_INERTIA, ROD_TRANSVERSE_INERTIA))
                for name in ("upper", "lower")
            ],
            "hinge": [
                {
                    "name": name,
                    "type": "ball",
                    "inboard": inboard,
                    "outboard": outboard,
                    "initial": {"u": spin},
                }
                for (name, inboard, outboard), spin in zip(hinge_ends, spins, strict=True)
            ],
        }
    )


@cache
def _exact() -> Array:
    return simulate_to_end(_two_rods(), T_END, rtol=1e-11, atol=1e-13, output_times=[T_END]).q[-1]


def _error(rate: float, additive: bool) -> float:
    steps = round(T_END * SPIN / rate)
    step = T_END / steps
    if additive:
        coordinates = additive_rotations.final_coordinates(_two_rods(), step, steps, RADIUS)
    else:
        method = ClassicalDiscreteTime(scheme=f"generalised-alpha:{RADIUS}")
        coordinates = simulate_to_end(_two_rods(), T_END, method, step, output_times=[T_END]).q[-1]
    return float(np.abs(coordinates - _exact()).max())


CASE = CaseDefinition(
    name="plain-turns",
    title="Finite rotations without the tangent operator",
    cause="The unknown of a body in space is a rotation vector from the predicted attitude; a "
    "change of that vector is a rotation only near zero. With the hinges as constraints, the error "
    "of the linear equations is a gap, which causes loads in the next step. The motion is lost "
    "within a second at steps that are far from long. The tangent operator in the matrices keeps "
    "the hinges closed.",
    parameter="step times angular velocity", unit="", low=3e-3, high=0.1, scale=LOG_SCALE,
    measured="error of the coordinates after 1 s", limit=0.02,
    method=MethodDefinition("dttmm-classical, T left out", lambda rate: _error(rate, True)),
    remedy=MethodDefinition("dttmm-classical", lambda rate: _error(rate, False)), reach=0.3,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 8; Brüls, "
    "Cardona, Arnold, Mechanism and Machine Theory 48, 2012",
)  # fmt: skip
