"""Indeterminate loads of rigid bodies: self-stress states of closed loops.

Combinations z of multipliers of redundant rows cause no motion: L z = 0.  Repeated solutions with
compliant rows, (L + give f) x = give f y from a random y, converge to the part of y in this null
space, at the cost of one sweep each.  A component of a hinge load is unique if no self-stress state
contains it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from mstmm.array_validation import Array

from .loop_calls import LoopCalls

#: Components of a load along and about the outboard axes of a hinge.
_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
#: Compliance relative to the mobility, number of repetitions, and number of random states.
_COMPLIANCE, _REPETITIONS, _RANDOM_STATES = 1e-7, 4, 2
#: Components that count as rounding: relative to the largest one, and as a multiple of the gaps (m,
#: rad) of redundant rows, which falsify the states.
_RELATIVE_ROUNDING, _GAP_FACTOR = 1e-5, 10.0

_UPPER_TRIANGLE = np.triu_indices(6)


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
    S = np.zeros((6, 6))
    S[_UPPER_TRIANGLE] = block[lib.MSTMM_BLOCK_S : lib.MSTMM_BLOCK_S + 21]
    S += np.triu(S, 1).T
    delta = block[lib.MSTMM_BLOCK_DELTA : lib.MSTMM_BLOCK_DELTA + 6]
    return np.asarray(S @ delta + block[lib.MSTMM_BLOCK_E : lib.MSTMM_BLOCK_E + 6])
