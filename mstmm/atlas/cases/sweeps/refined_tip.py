"""Refined Riccati sweep with heavier and heavier tips."""

from __future__ import annotations

from mstmm.errors import NumericalFailure, SceneError

from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from .heavy_tip import ROD_COUNT, error


def _refined_error(ratio: float) -> float:
    try:
        return error(ratio, "refined")
    except SceneError as failure:  # refinement does not converge any more
        raise NumericalFailure(str(failure)) from None


CASE = CaseDefinition(
    name="refined-tip",
    title="Refined sweep: a heavy body outboard of light ones",
    cause="Inverse dynamics eliminates nothing: the residual that it gives for the accelerations "
    "is accurate. The sweep solves for it with the digits that it has, so that each refinement "
    "reduces the error by the relative error of the sweep. Up to four are made, as many as the "
    "start needs. Where the sweep has no accurate digit, refinement fails.",
    parameter="mass of the last rod over that of the others",
    unit="",
    low=1e8,
    high=1e18,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative",
    limit=1e-8,
    method=MethodDefinition(f'refined (sweep="refined"), {ROD_COUNT} rods', _refined_error),
    remedy=MethodDefinition('least squares (sweep="qr")', lambda ratio: error(ratio, "qr")),
    reach=1e20,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)
