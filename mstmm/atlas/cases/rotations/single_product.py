"""Rotation vectors with only one of the products of their rate."""

from __future__ import annotations

from functools import partial

from ...definition import Definition, Method
from ...measures import TURNING, error_of_turning
from ...scale import LOG
from ...variants import plain_charts

#: Variant with one product.
ONE = partial(plain_charts.end_of, products=1)

CASE = Definition(
    name="single-product",
    title="Rotation vectors with one of two products",
    why="The rate of a rotation vector is the angular velocity plus products of both, each with "
    "one more power of the vector. With the first product alone the rate is accurate to third "
    "order within a step, and so is the result: a table of fourth or fifth order gains nothing. "
    "Runs with rotation vectors keep two products, enough for the fifth order of their tables.",
    parameter="length of a step", unit="s", low=4e-3, high=0.2, scale=LOG,
    measured=f"error of the attitude after {TURNING:g} s, rad", limit=1e-6,
    method=Method("rk4, one product kept", lambda h: error_of_turning(ONE, h)),
    remedy=Method("kvaerno5, two kept", lambda h: error_of_turning("kvaerno5", h)), reach=0.2,
    source="Munthe-Kaas, BIT 38, 1998; Iserles, Munthe-Kaas, Norsett, Zanna, Acta Numerica 9, 2000",
)  # fmt: skip
