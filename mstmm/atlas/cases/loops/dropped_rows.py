"""Constraint rows of a loop counted with true masses, for a heavy coupler."""

from __future__ import annotations

from functools import partial

from mstmm.errors import NumericalFailure, SceneError

from ....bridge.precise import precise, relative_error
from ...definition import Definition, Method
from ...scale import LOG
from ...scenes import four_bar, model
from ...variants import all_rows

SHARE = 1e-6


def _error(ratio: float, by_masses: bool) -> float:
    try:
        linkage = model(four_bar(ratio=ratio))
    except SceneError as refused:  # no digits are left
        raise NumericalFailure(str(refused)) from None
    q, u = linkage.initial_state()
    found = linkage.accelerations(q, u)[:3]
    if by_masses:
        tree, solved = model(four_bar(ratio=ratio, closed=False)), all_rows.of_least_size
        found = all_rows.accelerations_at_rest(linkage, tree, q, partial(solved, share=SHARE))
    return relative_error(found, precise(linkage)(q, u)[:3])


CASE = Definition(
    name="dropped-rows",
    title="Rank of a loop with true masses: a heavy coupler",
    why="The number of independent rows follows from the motions of the bodies under loads along "
    "the rows. A heavy coupler moves less than light cranks by the mass ratio. Once that is below "
    "the threshold of the rank, an independent row is dropped, and the linkage comes apart. The "
    "dependence of rows is a matter of geometry, not of masses: determined once with equal masses, "
    "both rows stay.",
    parameter="mass per length of the coupler over that of the cranks", unit="",
    low=1.0, high=1e10, scale=LOG,
    measured="error of the accelerations, relative", limit=1e-6,
    method=Method("rank with true masses, threshold 1e-6", lambda x: _error(x, True)),
    remedy=Method("rank with equal masses", lambda x: _error(x, False)), reach=1e16,
    source="Garcia de Jalon, Gutierrez-Lopez, Multibody System Dynamics 30, 2013 (redundant "
    "constraints); Golub, Van Loan, Matrix Computations, 4th ed., 2013, 5.5 (rank and scale)",
)  # fmt: skip
