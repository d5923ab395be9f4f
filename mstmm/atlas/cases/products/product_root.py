"""Plain product of transfer matrices along light bodies outboard of one heavy root."""

from __future__ import annotations

import math
from typing import Any

from ...definition import Definition, Method
from ...measures import correction
from ...scale import LOG
from ...scenes import drawn_pins, model, row_of

RODS = 8


def _error(ratio: float, **options: Any) -> float:
    row = model(row_of([ratio] + [1.0] * (RODS - 1)), **options)
    return correction(row, drawn_pins(RODS))


CASE = Definition(
    name="product-root",
    title="Product of transfer matrices: one heavy body at the root",
    why="All loads of the root pass through all matrices before the condition at the tip cancels "
    "them. One heavy body is enough: its loads are rounded at their size, and that error moves the "
    "light bodies outboard of it. The sweep reaches the heavy body last, and the contribution of "
    "the light bodies may be rounded there without harm.",
    parameter="mass of the first rod over that of the others", unit="", low=1.0, high=1e14,
    scale=LOG,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method(
        f"plain product, {RODS} rods", lambda r: _error(r, sweep="product", accuracy=math.inf)
    ),
    remedy=Method("Riccati sweep", _error), reach=1e20,
    source="Rui et al., Multibody System Dynamics 49, 2020; product: Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 5",
)  # fmt: skip
