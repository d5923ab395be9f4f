"""Plain product of transfer matrices with bodies that get lighter outboard."""

from __future__ import annotations

import math
from typing import Any

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import refinement_correction
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, random_pin_states, rod_chain

ROD_COUNT = 8


def _error(ratio: float, **options: Any) -> float:
    model = compile_looped(rod_chain([ratio**i for i in range(ROD_COUNT)]), **options)
    return refinement_correction(model, random_pin_states(ROD_COUNT))


CASE = CaseDefinition(
    name="product-masses",
    title="Product of transfer matrices: light bodies outboard of heavy ones",
    cause="The product passes the loads of the heavy root on to a tip, where they must cancel down "
    "to those of a light body. The mass ratio multiplies their rounding error. The sweep does not "
    "form that difference.",
    parameter="mass of a rod over that of its inboard neighbour", unit="", low=1e-3, high=1.0,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition(
        f"plain product, {ROD_COUNT} rods", lambda r: _error(r, sweep="product", accuracy=math.inf)
    ),
    remedy=MethodDefinition("Riccati sweep", _error), reach=1e-6,
    source="Rui et al., Multibody System Dynamics 49, 2020; product: Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 5",
)  # fmt: skip
