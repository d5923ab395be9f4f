"""Rotation vectors that keep one of the products that turns bring in."""

from __future__ import annotations

from functools import partial

from ...definition import Definition, Method
from ...measures import TURNING, error_of_turning
from ...scale import LOG
from ...variants import plain_charts

#: With one product.
ONE = partial(plain_charts.end_of, products=1)

CASE = Definition(
    name="single-product",
    title="Rotation vectors with one product of two",
    why="The rate of a rotation vector is the angular velocity and products of both, each of a "
    "power of the vector more. The first alone is right to third order within a step, and so is "
    "what comes out: a table of fourth or fifth order gains nothing on shorter steps that it was "
    "chosen for. Runs on charts keep two products, enough for the fifth order of their tables.",
    parameter="length of a step", unit="s", low=4e-3, high=0.2, scale=LOG,
    measured=f"error of the attitude after {TURNING:g} s, rad", limit=1e-6,
    method=Method("rk4, one product kept", lambda h: error_of_turning(ONE, h)),
    remedy=Method("kvaerno5, two kept", lambda h: error_of_turning("kvaerno5", h)), reach=0.2,
    source="Munthe-Kaas, BIT 38, 1998; Iserles, Munthe-Kaas, Norsett, Zanna, Acta Numerica 9, 2000",
)  # fmt: skip
