"""Couplings -> C records."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ...kernels import prebuilt_kernels
from ..system import CouplingNumbers, System
from .memory import Memory


@dataclass(frozen=True)
class WrittenCoupling:
    """A coupling, its row (-1: none), where its numbers begin behind those of all loops, and where
    -C of each of its hinges, by the hinge's place."""

    coupling: CouplingNumbers
    row: int
    numbers: int
    columns: dict[int, int]


def place_couplings(
    model: Any, system: System, rows: Sequence[int], take: Callable[[int], int]
) -> tuple[WrittenCoupling, ...]:
    """Rows and places of couplings, whose numbers one tape writes; `rows` are those of the ones
    that have one, `take` gives room for numbers that are no sums."""
    if system.coupled is None:
        return ()
    model.coupling_numbers = take(system.coupled.outputs[0].length())
    left, found = iter(rows), []
    own = int(prebuilt_kernels.module()[1].MSTMM_COUPLING)
    for one in system.couplings:
        first, columns = int(model.coupling_numbers) + one.first, dict[int, int]()
        at = first + own
        for hinge in one.hinges:
            columns[hinge.place] = at
            at += system.body(hinge.place).nu
        found.append(WrittenCoupling(one, -1 if one.repeats else next(left), first, columns))
    return tuple(found)


def attach_couplings(
    model: Any,
    system: System,
    memory: Memory,
    couplings: Sequence[WrittenCoupling],
    rows: Any,
    looped: Any,
    side: Callable[[int, int], int],
) -> None:
    """Give the model its couplings, and hinges that close loops those of their own speeds; `side`
    is the place of a row's column on a body."""
    records = memory.new("mstmm_coupling[]", max(1, len(couplings)))
    own: dict[int, list[tuple[int, int, int, int]]] = {}
    frames = {one.frame for one in system.closures}
    for record, one in zip(records, couplings, strict=False):
        kept = one.coupling.kept
        record.row, record.numbers = one.row, one.numbers
        record.kept = 0.0 if kept is None else kept
        record.of_speeds = int(one.coupling.of_speeds or kept is None)
        if one.row >= 0:
            rows[one.row].of_speeds = record.of_speeds
        for hinge in one.coupling.hinges:
            if hinge.place in frames and one.row >= 0:
                sides = side(hinge.inboard, one.row), side(hinge.outboard, one.row)
                own.setdefault(hinge.place, []).append((one.row, *sides, one.columns[hinge.place]))
    for frame, found in own.items():
        looped[frame].n_own, looped[frame].own = len(found), memory.new("mstmm_own[]", found)
    model.couplings, model.n_couplings = records, len(couplings)
    model.coupling_tape = memory.expression(system.coupled)
