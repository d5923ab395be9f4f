"""Rosenbrock steps on rotation vectors without the derivative of their rate."""

from __future__ import annotations

from functools import partial

from ...definition import Definition, Method
from ...measures import TURNING, error_of_turning
from ...scale import LOG
from ...variants import chart_rosenbrock

TABLE = "rodas4p2"
WITHOUT = partial(chart_rosenbrock.end_of, method=TABLE, slope=False)

CASE = Definition(
    name="turn-slope",
    title="Rosenbrock steps on rotation vectors: a missing derivative",
    why="A rotation vector starts every step at zero, where its rate is the angular velocity. "
    "The derivative of that rate by the vector, however, is half a product that does not vanish "
    "there. Without it in the tangent matrix all tables fall to second order. Runs include it.",
    parameter="length of a step", unit="s", low=4e-3, high=0.1, scale=LOG,
    measured=f"error of the attitude after {TURNING:g} s, rad", limit=1e-6,
    method=Method(f"{TABLE}, the derivative left out", lambda h: error_of_turning(WITHOUT, h)),
    remedy=Method(TABLE, lambda h: error_of_turning(TABLE, h)), reach=0.1,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 (order takes "
    "the whole Jacobian); Munthe-Kaas, BIT 38, 1998",
)  # fmt: skip
