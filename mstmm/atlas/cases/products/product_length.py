"""Plain product of transfer matrices along longer and longer chains."""

from __future__ import annotations

import math

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import refinement_correction
from ...parameter_scale import COUNT_SCALE
from ...shared_scenes import chain, compile_looped, random_pin_states


def _error(count: float, **options: float | str) -> float:
    bodies = int(count)
    return refinement_correction(
        compile_looped(chain(bodies), **options), random_pin_states(bodies)
    )


CASE = CaseDefinition(
    name="product-length",
    title="Product of transfer matrices: length of a chain",
    cause="The product eliminates from the root outwards, a shooting method: the rounding error of "
    "one body grows fourfold at the next, though the chain is well conditioned. The Riccati sweep "
    "eliminates from the tips inwards, with positive definite pivots.",
    parameter="rods on parallel pins", unit="", low=2, high=60, scale=COUNT_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition(
        "plain product", lambda n: _error(n, sweep="product", accuracy=math.inf)
    ),
    remedy=MethodDefinition("Riccati sweep", _error), reach=100_000,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.18, "
    "5.38); Riccati form: Rui et al., Multibody System Dynamics 49, 2020",
)  # fmt: skip
