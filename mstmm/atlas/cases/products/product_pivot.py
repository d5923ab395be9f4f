"""Plain product of transfer matrices near the centre of percussion."""

from __future__ import annotations

import math

from ...definition import Definition, Method
from ...measures import correction
from ...scale import LOG
from ...scenes import chain, drawn_pins, model

RODS = 6

#: Moment of a rod of 1 kg and 1 m about its mass centre whose output end is the centre of
#: percussion of its input end: M r_IC . (r_IO - r_IC).
DUMBBELL = 0.25


def _error(distance: float, **options: float | str) -> float:
    moment = DUMBBELL * (1 - distance)
    scene = chain(RODS, inertia=(moment,) * 3)
    return correction(model(scene, **options), drawn_pins(RODS))


CASE = Definition(
    name="product-pivot",
    title="Product of transfer matrices: a pivot that vanishes",
    why="The pivot of a planar pin is zero where the output end of its body is the centre of "
    "percussion of the input end, as for a dumbbell. An impact there does not move the inner end. "
    "Digits are lost long before the guard names the hinge.",
    parameter="distance of the moment of inertia from that of a dumbbell", unit="",
    low=1e-10, high=0.5, scale=LOG,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method(
        f"plain product, {RODS} rods", lambda d: _error(d, sweep="product", accuracy=math.inf)
    ),
    remedy=Method("Riccati sweep", _error), reach=1e-10,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.38)",
)  # fmt: skip
