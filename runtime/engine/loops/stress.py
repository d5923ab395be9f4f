"""Loads that rigid bodies do not determine: self-stress states of closed loops.

Multipliers z of rows that repeat others may grow together without moving anything: L z = 0.  Rows
that yield a little, (L + give f) x = give f y again and again from a random y, leave the share of
these alone, at the cost of a sweep each time.  A component of a hinge's load is unique where none
of them touches it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np

from mstmm.arrays import Array

from .calls import LoopCalls

#: Components of a load along and about the outboard axes of a hinge.
_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
#: Yielding in parts of the mobility, repetitions, and states drawn.
_GIVE, _TIMES, _DRAWN = 1e-7, 4, 2
#: Parts of the largest component that are rounding, and so many times the gaps (m, rad) that rows
#: which repeat others leave: by these the states are off.
_ROUNDING, _OFF = 1e-5, 10.0

_UPPER = np.triu_indices(6)


@dataclass(frozen=True)
class Open:
    """What is not unique: components of the loads of hinges, by their names, and rows of closures,
    by their numbers."""

    loads: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    rows: frozenset[int] = frozenset()


def not_unique(calls: LoopCalls, q: Array, silent: Collection[int] = ()) -> Open:
    """At the closed q (nq,), rows that are `silent` there left out.  `calls` are those of a
    geometry in which all rows are met."""
    gaps = np.abs(calls.correction(calls.gap, q, np.zeros(calls.engine.nu))[1])
    rounding = max(_ROUNDING, _OFF * float(gaps.max(initial=0.0)))
    drawn = [_touched(calls, q, silent, seed, rounding) for seed in range(_DRAWN)]
    touched, rows = (np.any(marks, axis=0) for marks in zip(*drawn, strict=True))
    packed, found = calls.engine.packed, dict[str, tuple[str, ...]]()
    for number, hinge in enumerate(packed.scene.hinges):
        marks = touched[packed.topology.place_of_hinge(number)]
        words = tuple(word for word, mark in zip(_COMPONENTS, marks, strict=True) if mark)
        if words and number not in packed.layout.internal:
            found[hinge.name] = words
    return Open(found, frozenset(np.flatnonzero(rows).tolist()))


def outboard_axes(calls: LoopCalls, place: int) -> Array:
    """(3, 3) outboard axes of the hinge at a place of the tree, in internal ones of its body."""
    packed = calls.engine.packed
    hinge = packed.scene.hinges[packed.topology.at(place)[1]]
    return np.reshape(packed.end(hinge.outboard)[1], (3, 3))


def _touched(
    calls: LoopCalls, q: Array, silent: Collection[int], seed: int, rounding: float
) -> tuple[Array, Array]:
    """Whether a drawn self-stress state loads the component of the inboard hinge (bodies, 6), and
    the row (rows,)."""
    for row in range(calls.count):
        calls.records.judge(row, np.inf if row in silent else 0.0)
    met = np.array(
        [row not in silent and not calls.records.yields(row) for row in range(calls.count)]
    )
    y = met * np.random.default_rng(seed).normal(size=calls.count) / np.sqrt(calls.mobility)
    for _ in range(_TIMES):
        y = met * calls.stressed(q, _GIVE * calls.mobility * y, _GIVE)
    return tuple(
        size > rounding * size.max(initial=0.0)
        for size in (_loads(calls), np.abs(y) * np.sqrt(calls.mobility))
    )


def _loads(calls: LoopCalls) -> Array:
    """(bodies, 6) sizes of the components of every inboard hinge's load, in outboard axes."""
    packed = calls.engine.packed
    found = np.zeros((packed.system.count, 6))
    for place in range(len(found)):
        load = _at_frame(calls, place)
        load[3:] += np.cross([0.0, 0.0, packed.system.body(place).height], load[:3])
        axes = outboard_axes(calls, place)
        found[place] = np.abs(np.concatenate([axes.T @ load[:3], axes.T @ load[3:]]))
    return found


def _at_frame(calls: LoopCalls, place: int) -> Array:
    """(6,) f = S delta + e that the last call left for a body, about its internal origin."""
    lib, first = calls.engine.lib, int(calls.engine.packed.written.blocks[place])
    numbers = calls.engine.workspace_array()[first:]
    S = np.zeros((6, 6))
    S[_UPPER] = numbers[lib.MSTMM_BLOCK_S : lib.MSTMM_BLOCK_S + 21]
    S += np.triu(S, 1).T
    delta = numbers[lib.MSTMM_BLOCK_DELTA : lib.MSTMM_BLOCK_DELTA + 6]
    return np.asarray(S @ delta + numbers[lib.MSTMM_BLOCK_E : lib.MSTMM_BLOCK_E + 6])
