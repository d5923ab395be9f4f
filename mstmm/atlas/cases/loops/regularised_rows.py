"""Loop whose constraint rows are regularised, near a singular configuration."""

from __future__ import annotations

from functools import partial

from ....pipeline.extended_precision import extended_precision_accelerations, relative_error
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, parallelogram
from ...variants import redundant_rows

REGULARISATION = 1e-8


def _error(angle: float, regularised: bool) -> float:
    linkage = compile_looped(parallelogram(angle))
    q, u = linkage.initial_state()
    udot = linkage.accelerations(q, u)[:3]
    if regularised:
        tree, solve_multipliers = (
            compile_looped(parallelogram(angle, closed=False)),
            redundant_rows.regularised_multipliers,
        )
        udot = redundant_rows.accelerations_at_rest(
            linkage, tree, q, partial(solve_multipliers, share=REGULARISATION)
        )
    return relative_error(udot, extended_precision_accelerations(linkage)(q, u)[:3])


CASE = CaseDefinition(
    name="regularised-rows",
    title="Regularised closed loops: a nearly singular parallelogram",
    cause="Redundant rows make the equations of the multipliers singular, and a small multiple of "
    "the unit matrix regularises them: every row then yields by that amount. Near a singular "
    "configuration one of the other rows responds with the square of the distance, and yields like "
    "the rest. The linkage then leaves its path long before the singular pose. A fixed choice of "
    "rows yields nowhere, until that row itself is lost in rounding.",
    parameter="angle from the pose with all rods in line", unit="rad",
    low=1e-5, high=1.0, scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition("all rows, 1e-8 of the unit matrix added", lambda x: _error(x, True)),
    remedy=MethodDefinition("a fixed choice of rows", lambda x: _error(x, False)), reach=1e-6,
    source="Neto, Ambrosio, Multibody System Dynamics 9, 2003 (redundant constraints, singular "
    "positions); Golub, Van Loan, Matrix Computations, 4th ed., 2013, 6.1 (ridge)",
)  # fmt: skip
