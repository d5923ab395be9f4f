"""Plain product of transfer matrices along light bodies outboard of one heavy root."""

from __future__ import annotations

import math
from typing import Any

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import refinement_correction
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, random_pin_states, rod_chain

ROD_COUNT = 8


def _error(ratio: float, **options: Any) -> float:
    model = compile_looped(rod_chain([ratio] + [1.0] * (ROD_COUNT - 1)), **options)
    return refinement_correction(model, random_pin_states(ROD_COUNT))


CASE = CaseDefinition(
    name="product-root",
    title="Product of transfer matrices: one heavy body at the root",
    cause="All loads of the root pass through all matrices before the condition at the tip cancels "
    "them. One heavy body is enough: its loads are rounded at their size, and that error moves the "
    "light bodies outboard of it. The sweep reaches the heavy body last, and the contribution of "
    "the light bodies may be rounded there without harm.",
    parameter="mass of the first rod over that of the others", unit="", low=1.0, high=1e14,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition(
        f"plain product, {ROD_COUNT} rods", lambda r: _error(r, sweep="product", accuracy=math.inf)
    ),
    remedy=MethodDefinition("Riccati sweep", _error), reach=1e20,
    source="Rui et al., Multibody System Dynamics 49, 2020; product: Rui, Wang, Zhang, Transfer "
    "Matrix Method for Multibody Systems, 2019, ch. 5",
)  # fmt: skip
