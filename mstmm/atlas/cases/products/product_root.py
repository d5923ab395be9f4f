"""The plain product of transfer matrices along light bodies behind one heavy root."""

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
    why="Whatever the root carries passes through all matrices before the tip says that nothing "
    "of it is left. One heavy body is enough: its loads are rounded in their own size, and the "
    "light ones behind it are moved by what that leaves. The sweep comes to the heavy body last, "
    "and what light ones add to it may well be rounded there.",
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
