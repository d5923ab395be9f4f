"""Constraint rows of a loop counted with true masses, for a heavy coupler."""

from __future__ import annotations

from functools import partial

from mstmm.errors import NumericalFailure, SceneError

from ....pipeline.extended_precision import extended_precision_accelerations, relative_error
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, four_bar
from ...variants import redundant_rows

RANK_THRESHOLD = 1e-6


def _error(ratio: float, by_masses: bool) -> float:
    try:
        linkage = compile_looped(four_bar(ratio=ratio))
    except SceneError as error:  # all digits are lost
        raise NumericalFailure(str(error)) from None
    q, u = linkage.initial_state()
    udot = linkage.accelerations(q, u)[:3]
    if by_masses:
        tree, solve_multipliers = (
            compile_looped(four_bar(ratio=ratio, closed=False)),
            redundant_rows.least_norm_multipliers,
        )
        udot = redundant_rows.accelerations_at_rest(
            linkage, tree, q, partial(solve_multipliers, share=RANK_THRESHOLD)
        )
    return relative_error(udot, extended_precision_accelerations(linkage)(q, u)[:3])


CASE = CaseDefinition(
    name="dropped-rows",
    title="Rank of a loop with true masses: a heavy coupler",
    cause="The number of independent rows follows from the motions of the bodies under loads along "
    "the rows. A heavy coupler moves less than light cranks by the mass ratio. Once that is below "
    "the threshold of the rank, an independent row is dropped, and the linkage comes apart. The "
    "dependence of rows is a matter of geometry, not of masses: determined once with equal masses, "
    "both rows stay.",
    parameter="mass per length of the coupler over that of the cranks", unit="",
    low=1.0, high=1e10, scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-6,
    method=MethodDefinition("rank with true masses, threshold 1e-6", lambda x: _error(x, True)),
    remedy=MethodDefinition("rank with equal masses", lambda x: _error(x, False)), reach=1e16,
    source="Garcia de Jalon, Gutierrez-Lopez, Multibody System Dynamics 30, 2013 (redundant "
    "constraints); Golub, Van Loan, Matrix Computations, 4th ed., 2013, 5.5 (rank and scale)",
)  # fmt: skip
