"""Rosenbrock steps on rotation vectors without the derivative of their rate."""

from __future__ import annotations

from functools import partial

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import ROTATION_TIME, attitude_error
from ...parameter_scale import LOG_SCALE
from ...variants import rotation_vector_rosenbrock

TABLE = "rodas4p2"
INCOMPLETE_VARIANT = partial(rotation_vector_rosenbrock.final_attitude, method=TABLE, slope=False)

CASE = CaseDefinition(
    name="turn-slope",
    title="Rosenbrock steps on rotation vectors: a missing derivative",
    cause="A rotation vector starts every step at zero, where its rate is the angular velocity. "
    "The derivative of that rate by the vector, however, is half a product that does not vanish "
    "there. Without it in the tangent matrix all tables fall to second order. Runs include it.",
    parameter="length of a step",
    unit="s",
    low=4e-3,
    high=0.1,
    scale=LOG_SCALE,
    measured=f"error of the attitude after {ROTATION_TIME:g} s, rad",
    limit=1e-6,
    method=MethodDefinition(
        f"{TABLE}, the derivative left out", lambda h: attitude_error(INCOMPLETE_VARIANT, h)
    ),
    remedy=MethodDefinition(TABLE, lambda h: attitude_error(TABLE, h)),
    reach=0.1,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 (order takes "
    "the whole Jacobian); Munthe-Kaas, BIT 38, 1998",
)
