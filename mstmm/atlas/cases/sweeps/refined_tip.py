"""The Riccati sweep refined, towards ever heavier tips."""

from __future__ import annotations

from mstmm.errors import NumericalFailure, SceneError

from ...definition import Definition, Method
from ...scale import LOG
from .heavy_tip import RODS, error


def _refined(ratio: float) -> float:
    try:
        return error(ratio, "refined")
    except SceneError as refused:  # it does not help any more
        raise NumericalFailure(str(refused)) from None


CASE = Definition(
    name="refined-tip",
    title="Refined sweep: a heavy body behind light ones",
    why="Inverse dynamics eliminates nothing: what it leaves over of accelerations is known well. "
    "The sweep answers it with the digits that it has, so that of what is wrong each refinement "
    "leaves the part that was wrong of the whole; up to four are made, as many as the start needs. "
    "Where the sweep has no digit left there is nothing to refine with.",
    parameter="mass of the last rod over that of the others", unit="", low=1e8, high=1e18,
    scale=LOG,
    measured="error of the accelerations, relative", limit=1e-8,
    method=Method(f'refined (sweep="refined"), {RODS} rods', _refined),
    remedy=Method('least squares (sweep="qr")', lambda ratio: error(ratio, "qr")), reach=1e20,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)  # fmt: skip
