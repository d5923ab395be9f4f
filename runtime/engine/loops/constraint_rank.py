"""Rank of constraint rows: redundant rows of closed loops, singular configurations, self-stress.

The rank is determined once, at a state with closed loops, in a metric of the hinges.  In the metric
of the true masses, a heavy coupler would reduce pivots of independent rows to rounding; in that of
any body masses, so would parts attached to a loop, such as the rest of a long mast.  The pivot of a
row that is redundant up to a misfit is proportional to the square of the misfit.  A row that is
redundant here but not in closed states nearby indicates a singular pose.

Self-stress states are combinations z of multipliers of redundant rows that cause no motion:
L z = 0.  Repeated solutions with compliant rows, (L + give f) x = give f y from a random y,
converge to the part of y in this null space, at the cost of one sweep each.  A component of a hinge
load is unique if no self-stress state contains it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ...packing.scene_packing import packed_system, without_merging
from ...packing.system_variants import (
    LOCKING_GAP_FRACTION,
    characteristic_length,
    with_hinge_inertia,
    with_unit_masses,
)
from ..looped_engine import LoopedEngine, symmetric_matrices
from .loop_calls import REDUNDANT_PIVOT, LoopCalls

#: Components of a load along and about the outboard axes of a hinge.
_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
#: Compliance relative to the mobility, number of repetitions, and number of random states.
_COMPLIANCE, _REPETITIONS, _RANDOM_STATES = 1e-7, 4, 2
#: Components that count as rounding: relative to the largest one, and as a multiple of the gaps (m,
#: rad) of redundant rows, which falsify the states.
_RELATIVE_ROUNDING, _GAP_FACTOR = 1e-5, 10.0


@dataclass(frozen=True)
class IndeterminateLoads:
    """Indeterminate loads: components by hinge name, and rows by index."""

    loads: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    rows: frozenset[int] = frozenset()


def find_indeterminate_loads(
    calls: LoopCalls, q: Array, silent: Collection[int] = ()
) -> IndeterminateLoads:
    """Find the indeterminate loads at the closed q (nq,), without the rows in `silent`.

    `calls` are those of a geometry in which all rows are satisfied.
    """
    gaps = np.abs(calls.correction(calls.position_level, q, np.zeros(calls.engine.nu))[1])
    rounding = max(_RELATIVE_ROUNDING, _GAP_FACTOR * float(gaps.max(initial=0.0)))
    random_marks = [
        _loaded_components(calls, q, silent, seed, rounding) for seed in range(_RANDOM_STATES)
    ]
    is_loaded, is_row_loaded = (np.any(marks, axis=0) for marks in zip(*random_marks, strict=True))
    packed, components_by_hinge = calls.engine.packed, dict[str, tuple[str, ...]]()
    for number, hinge in enumerate(packed.scene.hinges):
        marks = is_loaded[packed.topology.position_of_hinge(number)]
        components = tuple(
            component for component, mark in zip(_COMPONENTS, marks, strict=True) if mark
        )
        if components and number not in packed.layout.internal:
            components_by_hinge[hinge.name] = components
    return IndeterminateLoads(
        components_by_hinge, frozenset(np.flatnonzero(is_row_loaded).tolist())
    )


def outboard_axes(calls: LoopCalls, tree_index: int) -> Array:
    """Outboard axes (3, 3) of the hinge at a tree index, in internal axes of its body."""
    packed = calls.engine.packed
    hinge = packed.scene.hinges[packed.topology.scene_indices(tree_index)[1]]
    return np.reshape(packed.end(hinge.outboard)[1], (3, 3))


def _loaded_components(
    calls: LoopCalls, q: Array, silent: Collection[int], seed: int, rounding: float
) -> tuple[Array, Array]:
    """Masks of components (bodies, 6) and rows (rows,) loaded by a random self-stress state."""
    for row in range(calls.count):
        calls.records.set_pivot_floor(row, np.inf if row in silent else 0.0)
    is_imposed = np.array(
        [row not in silent and not calls.records.is_rotor_row(row) for row in range(calls.count)]
    )
    multipliers = (
        is_imposed * np.random.default_rng(seed).normal(size=calls.count) / np.sqrt(calls.mobility)
    )
    for _ in range(_REPETITIONS):
        multipliers = is_imposed * calls.solve_multipliers(
            q, _COMPLIANCE * calls.mobility * multipliers, _COMPLIANCE
        )
    return tuple(
        size > rounding * size.max(initial=0.0)
        for size in (_load_sizes(calls), np.abs(multipliers) * np.sqrt(calls.mobility))
    )


def _load_sizes(calls: LoopCalls) -> Array:
    """Magnitudes of the load components (bodies, 6) of inboard hinges, in outboard axes."""
    packed = calls.engine.packed
    sizes = np.zeros((packed.system.count, 6))
    for tree_index in range(len(sizes)):
        load = _load_at_origin(calls, tree_index)
        load[3:] += np.cross([0.0, 0.0, packed.system.body(tree_index).height], load[:3])
        axes = outboard_axes(calls, tree_index)
        sizes[tree_index] = np.abs(np.concatenate([axes.T @ load[:3], axes.T @ load[3:]]))
    return sizes


def _load_at_origin(calls: LoopCalls, tree_index: int) -> Array:
    """Load f = S delta + e (6,) of a body from the last call, about its internal origin."""
    lib, first = calls.engine.lib, int(calls.engine.packed.written.blocks[tree_index])
    block = calls.engine.workspace_array()[first:]
    S = symmetric_matrices(block[lib.MSTMM_BLOCK_S : lib.MSTMM_BLOCK_S + 21])
    delta = block[lib.MSTMM_BLOCK_DELTA : lib.MSTMM_BLOCK_DELTA + 6]
    return np.asarray(S @ delta + block[lib.MSTMM_BLOCK_E : lib.MSTMM_BLOCK_E + 6])


#: Closed states nearby: number, distance (rad, m), and the factor by which the coordinates of cut
#: hinges, which are dependent, may exceed it.
_NEIGHBOUR_COUNT, _NEIGHBOUR_DISTANCE, _MAX_CUT_FACTOR = 3, 3e-2, 10.0
#: Distance (rad, m) over which a row that is redundant up to a misfit must not lock.
_FAR_DISTANCE = 0.3
#: Closed states nearer than this fraction of the requested distance count as the pose itself.
_MIN_DISTANCE_RATIO = 0.1
#: Around a singular pose: maximum number of trials; distance (rad, m) over which a motion must
#: continue from a state, and its largest relative deviation; accuracy of the state (rad, m).
_MAX_TRIALS, _CONTINUATION_DISTANCE, _MAX_DEVIATION, _STATE_ACCURACY = 16, 3e-3, 0.2, 1e-8
#: A row that is redundant at the pose is redundant in another state if its pivot is at most this
#: many times larger, or at most rounding relative to the mobility.
_MAX_PIVOT_RATIO, _PIVOT_ROUNDING = 1e2, 1e-12
#: Maximum number of steps to a closed state, gap (m, rad) that counts as closed, initial compliance
#: of rows, and compliance relative to the remaining gap.
_MAX_STEPS, _CLOSED_GAP, _INITIAL_COMPLIANCE, _COMPLIANCE_PER_GAP = 200, 1e-9, 1e-6, 1e-2


@dataclass(frozen=True)
class Rank:
    """Redundant rows of closed loops at a state.

    Attributes:
        redundant_here: rows that are redundant at the state.
        always_redundant: rows of `redundant_here` that are also redundant in closed states nearby.
        removed_rows: rows of `always_redundant` that are removed; the others may replace another
            row of their hinge that becomes redundant in a pose farther away.
        states: examined states (nq,), the given one first.
        open: loads that are indeterminate because of redundant rows.
        min_redundant_count: smallest number of redundant rows in any of the states.
        is_stuck: True if all motions that close the loops to first order lead back to the pose, as
            with links stretched out in line.
    """

    redundant_here: frozenset[int]
    always_redundant: frozenset[int]
    removed_rows: frozenset[int]
    states: tuple[Array, ...]
    open: IndeterminateLoads
    min_redundant_count: int
    is_stuck: bool = False


def find_rank(engine: LoopedEngine, q: Array) -> Rank:
    """Find the redundant rows at a closed state q (nq,) and around it."""
    calls = geometric_loop_calls(engine, q)
    pivot_levels = REDUNDANT_PIVOT * calls.mobility
    redundant_here = _redundant_rows(calls, q, pivot_levels)
    if not redundant_here:
        return Rank(redundant_here, redundant_here, redundant_here, (q,), IndeterminateLoads(), 0)
    raised_levels = _MAX_PIVOT_RATIO * np.abs(calls.pivots()) + _PIVOT_ROUNDING * calls.mobility
    pivot_levels[list(redundant_here)] = np.minimum(pivot_levels, raised_levels)[
        list(redundant_here)
    ]
    states, is_stuck = _states_around(calls, q, redundant_here, pivot_levels)
    locking_gap = LOCKING_GAP_FRACTION * characteristic_length(engine.packed.system)
    is_stuck = is_stuck and not _is_misfit_only(calls, q, redundant_here, locking_gap)
    redundant_there = [_redundant_rows(calls, state, pivot_levels) for state in states]
    always_redundant = redundant_here.intersection(*redundant_there)
    nearby = min(map(len, (redundant_here, *redundant_there)))
    removed_rows = always_redundant.difference(
        *(_interchangeable_rows(calls, state, always_redundant) for state in (q, *states[:1]))
    )
    loads = (
        find_indeterminate_loads(calls, q, redundant_here - always_redundant)
        if always_redundant
        else IndeterminateLoads()
    )
    return Rank(
        redundant_here, always_redundant, removed_rows, (q, *states), loads, nearby, is_stuck
    )


def _states_around(
    calls: LoopCalls, q: Array, here: frozenset[int], level: Array
) -> tuple[list[Array], bool]:
    """Closed states nearby, and whether all motions to such states lead back to the pose.

    Around a singular pose, states from which a motion continues are preferred: others are closed
    only by rounding, or motions branch there.
    """
    random_generator, distances, states = np.random.default_rng(0), list[float](), list[Array]()

    def random_neighbour(settled: float) -> Array | None:
        near_q = _closed_neighbour(
            calls, q, random_generator.uniform(-1.0, 1.0, calls.engine.nu), settled
        )
        distances.extend([] if near_q is None else [_largest_change(calls, near_q - q)])
        return near_q

    states = [
        near_q for _ in range(_NEIGHBOUR_COUNT) if (near_q := random_neighbour(np.inf)) is not None
    ]
    is_distant = bool(distances) and min(distances) >= _MIN_DISTANCE_RATIO * _NEIGHBOUR_DISTANCE
    if is_distant and all(_redundant_rows(calls, near_q, level) == here for near_q in states):
        return states, False
    smooth_states = list[Array]()
    for _ in range(_MAX_TRIALS):
        near_q = random_neighbour(_STATE_ACCURACY)
        if near_q is None or distances[-1] < _MIN_DISTANCE_RATIO * _NEIGHBOUR_DISTANCE:
            continue
        if _continues_smoothly(
            calls, near_q, random_generator.uniform(-1.0, 1.0, calls.engine.nu), level
        ):
            smooth_states.append(near_q)
        if len(smooth_states) == _NEIGHBOUR_COUNT:
            break
    return smooth_states or states, max(
        distances, default=_NEIGHBOUR_DISTANCE
    ) < _MIN_DISTANCE_RATIO * _NEIGHBOUR_DISTANCE


def _largest_change(calls: LoopCalls, change: Array) -> float:
    """Largest change of q (nq,), without the dependent coordinates of cut hinges."""
    change_of_tree, packed = change.copy(), calls.engine.packed
    for cut in packed.expanded.cuts:
        if cut.constraint is None:
            change_of_tree[packed.layout.hinges[cut.hinge].q_slice] = 0.0
    return float(np.abs(change_of_tree).max(initial=0.0))


def geometric_loop_calls(engine: LoopedEngine, q: Array) -> LoopCalls:
    """Loop calls of a scene in the metric of its hinges, with mobilities of equal bodies.

    Bodies merged by simplification are separate again, with their welds.
    """
    packed = without_merging(engine.packed)
    mobility = LoopCalls(
        LoopedEngine(packed_system(with_unit_masses(packed.system), packed)), q
    ).mobility
    slides = {
        packed.hinge_position[hinge.name]: hinge.facts.slides
        for hinge in packed.user_scene.hinge if hinge.facts is not None
    }  # fmt: skip
    return LoopCalls(
        LoopedEngine(packed_system(with_hinge_inertia(packed.system, slides), packed)), q, mobility
    )


def _interchangeable_rows(calls: LoopCalls, q: Array, left_out: frozenset[int]) -> frozenset[int]:
    """Redundant rows that become independent if another row of their hinge is omitted.

    They are kept, and the rows to use are chosen during the motion.  All hinges are tried at the
    same time: the first omitted row of each replaces its first kept row, and so on.
    """
    rows_by_hinge = [set(closure.rows.values()) for closure in calls.records.closures]
    omitted_and_kept = [
        (sorted(rows & left_out), sorted(rows - left_out)) for rows in rows_by_hinge
    ]
    interchangeable: set[int] = set()
    for omitted_index, kept_index in product(range(6), range(6)):
        pairs = [
            (o[omitted_index], k[kept_index])
            for o, k in omitted_and_kept
            if omitted_index < len(o) and kept_index < len(k)
        ]
        if pairs:
            pivot_levels = REDUNDANT_PIVOT * calls.mobility
            pivot_levels[list(left_out | {k for _, k in pairs})] = np.inf
            pivot_levels[[o for o, _ in pairs]] = (
                REDUNDANT_PIVOT * calls.mobility[[o for o, _ in pairs]]
            )
            interchangeable |= {o for o, _ in pairs} - _redundant_rows(calls, q, pivot_levels)
    return frozenset(interchangeable)


def _redundant_rows(calls: LoopCalls, q: Array, level: Array) -> frozenset[int]:
    """Rows whose pivots are below their level if the preceding rows are satisfied."""
    for row, floor in enumerate(level.tolist()):
        calls.records.set_pivot_floor(row, floor)
    calls.correction(calls.velocity_level, q, np.zeros(calls.engine.nu))
    return frozenset(np.flatnonzero(calls.inverses() == 0.0).tolist())


def _closed_neighbour(calls: LoopCalls, q: Array, speeds: Array, settled: float) -> Array | None:
    """Closed state along the projected `speeds`, to an accuracy of `settled` (rad, m).

    None if there is no such state.
    """
    try:
        ahead_q = _move_along(calls, q, speeds, _NEIGHBOUR_DISTANCE, np.zeros(calls.count))
        return None if ahead_q is None else _close(calls, ahead_q, settled)
    except NumericalFailure:
        return None


def _is_misfit_only(calls: LoopCalls, q: Array, left: frozenset[int], apart: float) -> bool:
    """True if the rows `left` are redundant up to a misfit.

    A motion without them must lead far away in both directions, with gaps of these rows of at most
    `apart` (m, rad).
    """
    pivot_levels = np.zeros(calls.count)
    pivot_levels[list(left)] = np.inf
    speeds = np.random.default_rng(0).uniform(-1.0, 1.0, calls.engine.nu)
    try:
        for distance in (_FAR_DISTANCE, -_FAR_DISTANCE):
            ahead_q = _move_along(calls, q, np.sign(distance) * speeds, abs(distance), pivot_levels)
            near_q = None if ahead_q is None else _close(calls, ahead_q, _STATE_ACCURACY, left)
            if (
                near_q is None
                or _largest_change(calls, near_q - q) < _MIN_DISTANCE_RATIO * _FAR_DISTANCE
            ):
                return False
            gaps = np.abs(
                calls.correction(calls.position_level, near_q, np.zeros(calls.engine.nu))[1]
            )
            if gaps[list(left)].max() > apart:
                return False
    except NumericalFailure:
        return False
    return True


def _continues_smoothly(calls: LoopCalls, q: Array, speeds: Array, level: Array) -> bool:
    """True if the projected `speeds` lead to closed states.

    Rows with pivots below `level` are ignored.  False where motions branch.
    """
    try:
        ahead_q = _move_along(calls, q, speeds, _CONTINUATION_DISTANCE, level)
        near_q = None if ahead_q is None else _close(calls, ahead_q, _STATE_ACCURACY)
    except NumericalFailure:
        return False
    if near_q is None or ahead_q is None:
        return False
    return _largest_change(calls, near_q - ahead_q) < _MAX_DEVIATION * _largest_change(
        calls, ahead_q - q
    )


def _move_along(
    calls: LoopCalls, q: Array, speeds: Array, distance: float, level: Array
) -> Array | None:
    """Move q (nq,) by `distance` (rad, m) along projected speeds.

    Only rows with pivots above `level` are satisfied.  None if no speeds remain.
    """
    for row, floor in enumerate(level.tolist()):
        calls.records.set_pivot_floor(row, floor)
    tangent = speeds + calls.correction(calls.velocity_level, q, speeds)[0]
    length = float(np.abs(tangent).max(initial=0.0))
    if not length > 1e-9:
        return None
    near_q = calls.move(q, tangent * (distance / length))
    factor = min(distance / max(_largest_change(calls, near_q - q), _CLOSED_GAP), _MAX_CUT_FACTOR)
    return calls.move(q, tangent * (factor * distance / length)) if factor > 1.0 else near_q


def _close(
    calls: LoopCalls, near: Array, settled: float, left: Collection[int] = ()
) -> Array | None:
    """Closed state (nq,) near a given one, to an accuracy of `settled` (rad, m), or None.

    It satisfies all rows except those in `left`, including redundant rows.
    """
    zero_speeds, compliance = np.zeros(calls.engine.nu), _INITIAL_COMPLIANCE
    for row in range(calls.count):
        calls.records.set_pivot_floor(row, np.inf if row in left else 0.0)
    for _ in range(_MAX_STEPS):
        change, gaps = calls.correction(calls.position_level, near, zero_speeds, compliance)
        gaps[list(left)] = 0.0
        largest_gap = float(np.abs(gaps).max(initial=0.0))
        if largest_gap < _CLOSED_GAP and float(np.abs(change).max(initial=0.0)) < settled:
            return near
        near = calls.move(near, change)
        compliance = min(_INITIAL_COMPLIANCE, _COMPLIANCE_PER_GAP * largest_gap)
    return None
