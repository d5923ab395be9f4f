"""Plain product of transfer matrices along longer and longer chains."""

from __future__ import annotations

import math

from ...definition import Definition, Method
from ...measures import correction
from ...scale import COUNT
from ...scenes import chain, drawn_pins, model


def _error(count: float, **options: float | str) -> float:
    bodies = int(count)
    return correction(model(chain(bodies), **options), drawn_pins(bodies))


CASE = Definition(
    name="product-length",
    title="Product of transfer matrices: length of a chain",
    why="The product eliminates from the root outwards, a shooting method: the rounding error of "
    "one body grows fourfold at the next, though the chain is well conditioned. The Riccati sweep "
    "eliminates from the tips inwards, with positive definite pivots.",
    parameter="rods on parallel pins", unit="", low=2, high=60, scale=COUNT,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method(
        "plain product", lambda n: _error(n, sweep="product", accuracy=math.inf)
    ),
    remedy=Method("Riccati sweep", _error), reach=100_000,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.18, "
    "5.38); Riccati form: Rui et al., Multibody System Dynamics 49, 2020",
)  # fmt: skip
