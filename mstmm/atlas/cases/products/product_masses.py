"""The plain product of transfer matrices towards ever lighter bodies."""

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
    title="Product of transfer matrices: light bodies behind heavy ones",
    why="The product carries the loads of the heavy root along to a tip where they must cancel to "
    "those of a light body: what rounding leaves of them is multiplied by the ratio of the masses. "
    "The sweep never meets the difference.",
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
