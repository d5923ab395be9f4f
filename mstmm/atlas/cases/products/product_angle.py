"""Plain product of transfer matrices with pins at an angle to each other."""

from __future__ import annotations

import math

import numpy as np

from ...definition import Definition, Method
from ...measures import correction
from ...scale import LINEAR
from ...scenes import chain, drawn_pins, model

RODS = 6


def _error(degrees: float, **options: float | str) -> float:
    scene = chain(RODS, skew=float(np.deg2rad(degrees)))
    return correction(model(scene, **options), drawn_pins(RODS))


CASE = Definition(
    name="product-angle",
    title="Product of transfer matrices: angle between neighbouring axes",
    why="The pivot of a pin's matrix is the inertia of one body that couples its axis with that "
    "of the next pin. It falls with the cosine of the angle and is zero at 90 degrees, usual in "
    "robot arms, while the mass matrix stays regular.",
    parameter="angle between neighbouring pins", unit="degrees", low=0.0, high=90.0, scale=LINEAR,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method(
        f"plain product, {RODS} rods", lambda a: _error(a, sweep="product", accuracy=math.inf)
    ),
    remedy=Method("Riccati sweep", _error), reach=90.0,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.61)",
)  # fmt: skip
