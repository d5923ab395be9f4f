"""Rotation vectors integrated as if rotations could be added."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import ROTATION_TIME, attitude_error
from ...parameter_scale import LOG_SCALE
from ...variants import naive_rotation_vectors

CASE = CaseDefinition(
    name="plain-charts",
    title="Rotation vectors whose rate is the angular velocity",
    cause="Within a step an attitude may be described by a rotation vector, three numbers without "
    "a constraint. Its rate equals the angular velocity only where it is zero; elsewhere products "
    "of both are added. Without them every method falls to second order, whatever the order of its "
    "table. Runs keep two of them, enough for fifth order, or use quaternions.",
    parameter="length of a step",
    unit="s",
    low=2e-3,
    high=0.1,
    scale=LOG_SCALE,
    measured=f"error of the attitude after {ROTATION_TIME:g} s, rad",
    limit=1e-4,
    method=MethodDefinition(
        "rk4, the products left out",
        lambda h: attitude_error(naive_rotation_vectors.final_attitude, h),
    ),
    remedy=MethodDefinition("rk4", lambda h: attitude_error("rk4", h)),
    reach=0.1,
    source="Munthe-Kaas, BIT 38, 1998; Brüls, Cardona, Arnold, Mechanism and Machine Theory 48, "
    "2012",
)
