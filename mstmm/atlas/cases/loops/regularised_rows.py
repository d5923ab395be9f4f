"""Loop whose constraint rows are regularised, near a singular configuration."""

from __future__ import annotations

from functools import partial

from ....bridge.precise import precise, relative_error
from ...definition import Definition, Method
from ...scale import LOG
from ...scenes import model, parallelogram
from ...variants import all_rows

SHARE = 1e-8


def _error(angle: float, regularised: bool) -> float:
    linkage = model(parallelogram(angle))
    q, u = linkage.initial_state()
    found = linkage.accelerations(q, u)[:3]
    if regularised:
        tree, solved = model(parallelogram(angle, closed=False)), all_rows.regularised
        found = all_rows.accelerations_at_rest(linkage, tree, q, partial(solved, share=SHARE))
    return relative_error(found, precise(linkage)(q, u)[:3])


CASE = Definition(
    name="regularised-rows",
    title="Regularised closed loops: a nearly singular parallelogram",
    why="Redundant rows make the equations of the multipliers singular, and a small multiple of "
    "the unit matrix regularises them: every row then yields by that amount. Near a singular "
    "configuration one of the other rows responds with the square of the distance, and yields like "
    "the rest. The linkage then leaves its path long before the singular pose. A fixed choice of "
    "rows yields nowhere, until that row itself is lost in rounding.",
    parameter="angle from the pose with all rods in line", unit="rad",
    low=1e-5, high=1.0, scale=LOG,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method("all rows, 1e-8 of the unit matrix added", lambda x: _error(x, True)),
    remedy=Method("a fixed choice of rows", lambda x: _error(x, False)), reach=1e-6,
    source="Neto, Ambrosio, Multibody System Dynamics 9, 2003 (redundant constraints, singular "
    "positions); Golub, Van Loan, Matrix Computations, 4th ed., 2013, 6.1 (ridge)",
)  # fmt: skip
