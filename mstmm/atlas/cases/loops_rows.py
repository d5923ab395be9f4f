"""Cases of constraint rows and loads of closed loops."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure, SceneError
from ...graph.mechanism_graph import GROUND, Edge, MechanismGraph, Tree, total_cost
from ...graph.spanning_tree import breadth_first_tree, spanning_tree
from ...pipeline.extended_precision import extended_precision_accelerations, relative_error
from ...runtime.engine.looped_engine import LoopedEngine
from ...runtime.engine.loops.loop_calls import LoopCalls
from ...runtime.model.model import Model
from ...runtime.packing.scene_packing import pack
from ..case_definition import COUNT_SCALE, LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import rounding_error
from ..shared_scenes import compile_looped, four_bar, parallelogram, rod_arch

# --- redundant rows -------------------------------------------------------------------------------
#
# Closed loops with all their constraint rows, including redundant ones.
#
# M a + G' l = M a0 and G a = 0 at rest, of which the multipliers l solve S l = G a0, S = G M^-1 G'.
# With redundant rows S is singular, and the multipliers are not unique. They are either those of
# least norm, with singular values of S below a fraction of the largest one taken as zero (G. H.
# Golub, C. F. Van Loan, Matrix Computations, 2013, 5.5), or those of S regularised by a multiple of
# the unit matrix.


def least_norm_multipliers(mobility: Array, right: Array, share: float | None = None) -> Array:
    """Multipliers of least norm; rank limit: `share` times the largest singular value."""
    return np.asarray(np.linalg.lstsq(mobility, right, rcond=share)[0], dtype=np.float64)


def regularised_multipliers(mobility: Array, right: Array, share: float) -> Array:
    """Multipliers after adding `share` times the mean diagonal entry to all diagonal entries."""
    rows = len(mobility)
    return np.linalg.solve(mobility + share * np.trace(mobility) / rows * np.eye(rows), right)


def accelerations_at_rest(
    closed: Model,
    tree: Model,
    q: Array,
    solve_multipliers: Callable[[Array, Array], Array] = least_norm_multipliers,
) -> Array:
    """Accelerations (nu,) of the tree at its coordinates q, with all rows of the loops.

    In `closed` the cut hinges follow the hinges of `tree`; `solve_multipliers(S, G a0)` returns
    the multipliers.
    """
    engine, zeros = LoopedEngine(pack(closed.scene)), np.zeros(tree.nu)
    calls = LoopCalls(engine, q)
    slip_columns = [
        calls.correction(calls.velocity_level, q, unit_speed)[1]
        for unit_speed in np.eye(tree.nu, engine.nu)
    ]
    rows = np.ascontiguousarray(np.transpose(slip_columns))
    tree_q = np.ascontiguousarray(q[: tree.nq])
    tree_udot, responses = tree.accelerations(tree_q, zeros), tree.solve(tree_q, rows.T).T
    multipliers = solve_multipliers(rows @ responses.T, rows @ tree_udot)
    return np.asarray(tree_udot - multipliers @ responses)


# --- repeated-rows --------------------------------------------------------------------------------


@cache
def _askew_linkage(askew: float) -> Model:
    try:
        return compile_looped(four_bar(askew=askew))
    except SceneError as error:
        raise NumericalFailure(str(error)) from None


def _askew_error(udot: Array) -> float:
    """Relative error against the linkage with parallel axes."""
    aligned = _askew_linkage(0.0)
    exact = aligned.accelerations(*aligned.initial_state())[: len(udot)]
    return float(np.abs(udot - exact).max() / np.abs(exact).max())


def _error_with_all_rows(askew: float) -> float:
    linkage, tree = _askew_linkage(askew), compile_looped(four_bar(askew=askew, closed=False))
    return _askew_error(accelerations_at_rest(linkage, tree, linkage.initial_state()[0]))


def _error_with_fixed_rows(askew: float) -> float:
    linkage = _askew_linkage(askew)
    return _askew_error(linkage.accelerations(*linkage.initial_state())[:3])


REPEATED_ROWS = CaseDefinition(
    name="repeated-rows",
    title="Redundant rows with axes not quite parallel: a four-bar",
    cause="A pin that closes a planar loop in space has five rows, of which three are redundant. "
    "Where the axes are misaligned by less than any drawing tolerance, these rows disagree by the "
    "square of the angle. Once that exceeds rounding, a rank by rounding keeps them, and the "
    "linkage is locked. Compared with the mobility of their hinge they are redundant, and are left "
    "out for the whole run. Where the gap that they leave is a thousandth of the scene, the scene "
    "is rejected with a message.",
    parameter="misalignment of the axes", unit="rad", low=1e-11, high=1e-3, scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-3,
    method=MethodDefinition("all rows, rank by rounding (pseudo-inverse)", _error_with_all_rows),
    remedy=MethodDefinition("rows compared by mobility, a fixed choice", _error_with_fixed_rows),
    reach=1e-2,
    source="Garcia de Jalon, Gutierrez-Lopez, Multibody System Dynamics 30, 2013 (redundant "
    "constraints and their forces)",
)  # fmt: skip


# --- regularised-rows -----------------------------------------------------------------------------

REGULARISATION = 1e-8


def _linkage_error(
    scene: Callable[..., dict[str, Any]],
    solve_multipliers: Callable[[Array, Array], Array] | None = None,
) -> float:
    """Relative error of the accelerations of a linkage at its start, by all rows or by a choice.

    `scene(closed=...)` is the linkage or its tree; `solve_multipliers` as in
    `accelerations_at_rest`, or None for the rows that runs choose.
    """
    try:
        linkage = compile_looped(scene(closed=True))
    except SceneError as error:  # all digits are lost
        raise NumericalFailure(str(error)) from None
    q, u = linkage.initial_state()
    udot = linkage.accelerations(q, u)[:3]
    if solve_multipliers is not None:
        tree = compile_looped(scene(closed=False))
        udot = accelerations_at_rest(linkage, tree, q, solve_multipliers)
    return relative_error(udot, extended_precision_accelerations(linkage)(q, u)[:3])


def _regularised_error(angle: float) -> float:
    regularised = partial(regularised_multipliers, share=REGULARISATION)
    return _linkage_error(partial(parallelogram, angle), regularised)


REGULARISED_ROWS = CaseDefinition(
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
    method=MethodDefinition("all rows, 1e-8 of the unit matrix added", _regularised_error),
    remedy=MethodDefinition(
        "a fixed choice of rows", lambda x: _linkage_error(partial(parallelogram, x))
    ),
    reach=1e-6,
    source="Neto, Ambrosio, Multibody System Dynamics 9, 2003 (redundant constraints, singular "
    "positions); Golub, Van Loan, Matrix Computations, 4th ed., 2013, 6.1 (ridge)",
)  # fmt: skip


# --- dropped-rows ---------------------------------------------------------------------------------

RANK_THRESHOLD = 1e-6


def _dropped_error(ratio: float) -> float:
    by_masses = partial(least_norm_multipliers, share=RANK_THRESHOLD)
    return _linkage_error(partial(four_bar, ratio=ratio), by_masses)


DROPPED_ROWS = CaseDefinition(
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
    method=MethodDefinition("rank with true masses, threshold 1e-6", _dropped_error),
    remedy=MethodDefinition(
        "rank with equal masses", lambda x: _linkage_error(partial(four_bar, ratio=x))
    ),
    reach=1e16,
    source="Garcia de Jalon, Gutierrez-Lopez, Multibody System Dynamics 30, 2013 (redundant "
    "constraints); Golub, Van Loan, Matrix Computations, 4th ed., 2013, 5.5 (rank and scale)",
)  # fmt: skip


# --- heavy-link -----------------------------------------------------------------------------------

ROD_COUNT = 5


def _arch_error(ratio: float, refined: bool) -> float:
    try:
        arch = compile_looped(rod_arch([1.0, 1.0, 1.0, ratio, 1.0]))
    except SceneError as error:  # all digits are lost
        raise NumericalFailure(str(error)) from None
    arch.packed_scene.model.refines = int(refined)
    return rounding_error(arch, [arch.initial_state()])


HEAVY_LINK = CaseDefinition(
    name="heavy-link",
    title="Closed loops: a heavy link outboard of light ones",
    cause="The loads that close a loop follow from the accelerations of its rods under a load at "
    "the cut. Light rods inboard of a heavy one respond far more than it does, and its response is "
    "a difference of large numbers. Inverse dynamics eliminates nothing: its residual is small and "
    "accurate, and a second sweep corrects the result by it.",
    parameter="mass of the fourth rod over that of the others", unit="", low=1.0, high=1e13,
    scale=LOG_SCALE,
    measured="error of the accelerations, relative", limit=1e-9,
    method=MethodDefinition(
        f"one sweep, {ROD_COUNT} rods between two points", lambda x: _arch_error(x, False)
    ),
    remedy=MethodDefinition("refined by one more sweep", lambda x: _arch_error(x, True)),
    reach=1e16,
    source="Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 12 (iterative "
    "refinement)",
)  # fmt: skip


# --- grown-tree -----------------------------------------------------------------------------------

#: Number of constraint rows of a pin that closes a planar loop.
PIN_ROWS = 2


def _lift(pairs: int) -> MechanismGraph:
    """Scissor lift: pairs of bars pinned in the middle and to the tips of the pair below."""
    hinges = [(GROUND, 0), (0, 1)]
    for bar in range(2, 2 * pairs, 2):
        hinges += [(bar - 1, bar), (bar - 2, bar + 1), (bar, bar + 1)]
    return MechanismGraph(
        2 * pairs, tuple(Edge(first, second, PIN_ROWS) for first, second in hinges)
    )


def _mean_work(pairs: float, build_tree: Callable[[MechanismGraph], Tree]) -> float:
    """Mean number of pairs of rows per hinge of the tree."""
    lift = _lift(int(pairs))
    return total_cost(lift, build_tree(lift)) / lift.bodies


GROWN_TREE = CaseDefinition(
    name="grown-tree",
    title="Closed loops: the tree of a scissor lift",
    cause="Rows of a loop are carried through every hinge from the cut to the body where the loop "
    "closes, and all pairs of rows at a hinge are coupled. Grown breadth first (shortest paths), "
    "the tree of a lift supports each bar from below and cuts the middle pins. All loops close at "
    "the base, and the work grows with the square of their number. Depth first is as bad for "
    "adjacent windows. So both are tried with some random trees, and hinges are swapped as long as "
    "that reduces the work.",
    parameter="pairs of crossed bars", unit="", low=2, high=300, scale=COUNT_SCALE,
    measured="pairs of rows at a hinge, mean", limit=100.0,
    method=MethodDefinition("breadth first", lambda n: _mean_work(n, breadth_first_tree)),
    remedy=MethodDefinition(
        "best of several trees, with swaps", lambda n: _mean_work(n, spanning_tree)
    ),
    reach=1000,
    source="Amaldi, Liberti, Maffioli, Maculan, Mathematical Methods of Operations Research 69, "
    "2009 (fundamental cycles by swaps); Wittenburg, Dynamics of Multibody Systems, 2008, ch. 5",
)  # fmt: skip


CASES = (REPEATED_ROWS, REGULARISED_ROWS, DROPPED_ROWS, HEAVY_LINK, GROWN_TREE)
