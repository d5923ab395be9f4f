"""Refined Riccati sweep with heavier and heavier tips."""

from __future__ import annotations

from mstmm.errors import NumericalFailure, SceneError

from ...definition import Definition, Method
from ...scale import LOG
from .heavy_tip import RODS, error


def _refined(ratio: float) -> float:
    try:
        return error(ratio, "refined")
    except SceneError as refused:  # refinement does not converge any more
        raise NumericalFailure(str(refused)) from None


CASE = Definition(
    name="refined-tip",
    title="Refined sweep: a heavy body outboard of light ones",
    why="Inverse dynamics eliminates nothing: the residual that it gives for the accelerations "
    "is accurate. The sweep solves for it with the digits that it has, so that each refinement "
    "reduces the error by the relative error of the sweep. Up to four are made, as many as the "
    "start needs. Where the sweep has no accurate digit, refinement fails.",
    parameter="mass of the last rod over that of the others", unit="", low=1e8, high=1e18,
    scale=LOG,
    measured="error of the accelerations, relative", limit=1e-8,
    method=Method(f'refined (sweep="refined"), {RODS} rods', _refined),
    remedy=Method('least squares (sweep="qr")', lambda ratio: error(ratio, "qr")), reach=1e20,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)  # fmt: skip
