"""Plain product of transfer matrices near the centre of percussion."""

from __future__ import annotations

import math

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import refinement_correction
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import chain, compile_looped, random_pin_states

ROD_COUNT = 6

#: Moment of a rod of 1 kg and 1 m about its mass centre whose output end is the centre of
#: percussion of its input end: M r_IC . (r_IO - r_IC).
DUMBBELL_INERTIA = 0.25


def _error(distance: float, **options: float | str) -> float:
    moment = DUMBBELL_INERTIA * (1 - distance)
    scene = chain(ROD_COUNT, inertia=(moment,) * 3)
    return refinement_correction(compile_looped(scene, **options), random_pin_states(ROD_COUNT))


CASE = CaseDefinition(
    name="product-pivot",
    title="Product of transfer matrices: a pivot that vanishes",
    cause="The pivot of a planar pin is zero where the output end of its body is the centre of "
    "percussion of the input end, as for a dumbbell. An impact there does not move the inner end. "
    "Digits are lost long before the guard names the hinge.",
    parameter="distance of the moment of inertia from that of a dumbbell", unit="",
    low=1e-10, high=0.5, scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition(
        f"plain product, {ROD_COUNT} rods", lambda d: _error(d, sweep="product", accuracy=math.inf)
    ),
    remedy=MethodDefinition("Riccati sweep", _error), reach=1e-10,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.38)",
)  # fmt: skip
