"""Plain product of transfer matrices with bodies that get lighter outboard."""

from __future__ import annotations

import math
from typing import Any

from ...definition import Definition, Method
from ...measures import correction
from ...scale import LOG
from ...scenes import drawn_pins, model, row_of

RODS = 8


def _error(ratio: float, **options: Any) -> float:
    row = model(row_of([ratio**i for i in range(RODS)]), **options)
    return correction(row, drawn_pins(RODS))


CASE = Definition(
    name="product-masses",
    title="Product of transfer matrices: light bodies outboard of heavy ones",
    why="The product passes the loads of the heavy root on to a tip, where they must cancel down "
    "to those of a light body. The mass ratio multiplies their rounding error. The sweep does not "
    "form that difference.",
    parameter="mass of a rod over that of its inboard neighbour", unit="", low=1e-3, high=1.0,
    scale=LOG,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method(
        f"plain product, {RODS} rods", lambda r: _error(r, sweep="product", accuracy=math.inf)
    ),
    remedy=Method("Riccati sweep", _error), reach=1e-6,
    source="Rui et al., Multibody System Dynamics 49, 2020; product: Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 5",
)  # fmt: skip
