"""Plain product of transfer matrices with pins at an angle to each other."""

from __future__ import annotations

import math

import numpy as np

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import refinement_correction
from ...parameter_scale import LINEAR_SCALE
from ...shared_scenes import chain, compile_looped, random_pin_states

ROD_COUNT = 6


def _error(degrees: float, **options: float | str) -> float:
    scene = chain(ROD_COUNT, skew=float(np.deg2rad(degrees)))
    return refinement_correction(compile_looped(scene, **options), random_pin_states(ROD_COUNT))


CASE = CaseDefinition(
    name="product-angle",
    title="Product of transfer matrices: angle between neighbouring axes",
    cause="The pivot of a pin's matrix is the inertia of one body that couples its axis with that "
    "of the next pin. It falls with the cosine of the angle and is zero at 90 degrees, usual in "
    "robot arms, while the mass matrix stays regular.",
    parameter="angle between neighbouring pins",
    unit="degrees",
    low=0.0,
    high=90.0,
    scale=LINEAR_SCALE,
    measured="error of the accelerations, relative",
    limit=1e-6,
    method=MethodDefinition(
        f"plain product, {ROD_COUNT} rods", lambda a: _error(a, sweep="product", accuracy=math.inf)
    ),
    remedy=MethodDefinition("Riccati sweep", _error),
    reach=90.0,
    source="Rui, Wang, Zhang, Transfer Matrix Method for Multibody Systems, 2019, ch. 5 (5.61)",
)
