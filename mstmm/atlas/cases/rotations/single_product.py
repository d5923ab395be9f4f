"""Rotation vectors with only one of the products of their rate."""

from __future__ import annotations

from functools import partial

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import ROTATION_TIME, attitude_error
from ...parameter_scale import LOG_SCALE
from ...variants import naive_rotation_vectors

#: Variant with one product.
ONE_PRODUCT_VARIANT = partial(naive_rotation_vectors.final_attitude, products=1)

CASE = CaseDefinition(
    name="single-product",
    title="Rotation vectors with one of two products",
    cause="The rate of a rotation vector is the angular velocity plus products of both, each with "
    "one more power of the vector. With the first product alone the rate is accurate to third "
    "order within a step, and so is the result: a table of fourth or fifth order gains nothing. "
    "Runs with rotation vectors keep two products, enough for the fifth order of their tables.",
    parameter="length of a step",
    unit="s",
    low=4e-3,
    high=0.2,
    scale=LOG_SCALE,
    measured=f"error of the attitude after {ROTATION_TIME:g} s, rad",
    limit=1e-6,
    method=MethodDefinition(
        "rk4, one product kept", lambda h: attitude_error(ONE_PRODUCT_VARIANT, h)
    ),
    remedy=MethodDefinition("kvaerno5, two kept", lambda h: attitude_error("kvaerno5", h)),
    reach=0.2,
    source="Munthe-Kaas, BIT 38, 1998; Iserles, Munthe-Kaas, Norsett, Zanna, Acta Numerica 9, 2000",
)
