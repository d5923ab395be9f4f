"""Rotation vectors that keep one of the products that turns bring in."""

from __future__ import annotations

from functools import partial

from ...definition import Definition, Method
from ...scale import LOG
from ...variants import plain_charts
from .plain_charts import T_END, error_of


def _error(step: float, products: int) -> float:
    return error_of(partial(plain_charts.end_of, products=1) if products < 2 else "kvaerno5", step)


CASE = Definition(
    name="single-product",
    title="Rotation vectors with one product of two",
    why="The rate of a rotation vector is the angular velocity and products of both, each of a "
    "power of the vector more. The first alone is right to third order within a step, and so is "
    "what comes out: a table of fourth or fifth order gains nothing on shorter steps that it was "
    "chosen for. Runs on charts keep two products, enough for the fifth order of their tables.",
    parameter="length of a step", unit="s", low=4e-3, high=0.2, scale=LOG,
    measured=f"error of the attitude after {T_END:g} s, rad", limit=1e-6,
    method=Method("rk4, one product kept", lambda step: _error(step, 1)),
    remedy=Method("kvaerno5, two kept", lambda step: _error(step, 2)), reach=0.2,
    source="Munthe-Kaas, BIT 38, 1998; Iserles, Munthe-Kaas, Norsett, Zanna, Acta Numerica 9, 2000",
)  # fmt: skip
