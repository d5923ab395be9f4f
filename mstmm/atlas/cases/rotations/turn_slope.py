"""Rosenbrock steps on rotation vectors whose rate is taken not to change with them."""

from __future__ import annotations

from functools import partial

from ...definition import Definition, Method
from ...scale import LOG
from ...variants import chart_rosenbrock
from .plain_charts import T_END, error_of

TABLE = "rodas4p2"


def _error(step: float, slope: bool) -> float:
    without = partial(chart_rosenbrock.end_of, method=TABLE, slope=False)
    return error_of(TABLE if slope else without, step)


CASE = Definition(
    name="turn-slope",
    title="Rosenbrock steps on rotation vectors: a slope left out",
    why="A rotation vector begins every step at zero, where its rate is the angular velocity; but "
    "how that rate changes with the vector is half a product that does not vanish there. Left out "
    "of the tangent, for the vector is nothing anyway, it takes all tables to second order. Runs "
    "have it in their tangent.",
    parameter="length of a step", unit="s", low=4e-3, high=0.1, scale=LOG,
    measured=f"error of the attitude after {T_END:g} s, rad", limit=1e-6,
    method=Method(f"{TABLE}, the slope left out", lambda step: _error(step, False)),
    remedy=Method(TABLE, lambda step: _error(step, True)), reach=0.1,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7 (order takes "
    "the whole Jacobian); Munthe-Kaas, BIT 38, 1998",
)  # fmt: skip
