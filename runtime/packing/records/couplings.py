"""C records of couplings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from ...kernels import prebuilt_kernels
from ..system import CouplingNumbers, System
from .memory import Memory


@dataclass(frozen=True)
class WrittenCoupling:
    """Coupling in the records.

    Attributes:
        coupling: its numbers.
        row: its constraint row, -1 without one.
        numbers: offset of its numbers in those of all loops.
        columns: hinge, by position in the tree -> offset of its -C.
    """

    coupling: CouplingNumbers
    row: int
    numbers: int
    columns: dict[int, int]


def assign_couplings(
    model: Any, system: System, rows: Sequence[int], take: Callable[[int], int]
) -> tuple[WrittenCoupling, ...]:
    """Assign rows and offsets to the couplings, whose numbers are the output of one tape.

    `rows` are the rows of the couplings that have one; `take` reserves numbers.
    """
    if system.coupling_kernel is None:
        return ()
    model.coupling_numbers = take(system.coupling_kernel.outputs[0].length())
    next_row, written = iter(rows), []
    header_length = int(prebuilt_kernels.module()[1].MSTMM_COUPLING)
    for coupling in system.couplings:
        first, columns = int(model.coupling_numbers) + coupling.first, dict[int, int]()
        column = first + header_length
        for hinge in coupling.hinges:
            columns[hinge.position] = column
            column += system.body(hinge.position).nu
        row = -1 if coupling.repeats else next(next_row)
        written.append(WrittenCoupling(coupling, row, first, columns))
    return tuple(written)


def attach_couplings(
    model: Any,
    system: System,
    memory: Memory,
    couplings: Sequence[WrittenCoupling],
    rows: Any,
    looped: Any,
    side: Callable[[int, int], int],
) -> None:
    """Write the couplings to the model, and to cut hinges the couplings of their own speeds.

    `side` gives the offset of a row's column on a body.
    """
    records = memory.new("mstmm_coupling[]", max(1, len(couplings)))
    own: dict[int, list[tuple[int, int, int, int]]] = {}
    frames = {closure.frame for closure in system.closures}
    for record, written in zip(records, couplings, strict=False):
        row, kept = written.row, written.coupling.constant
        record.row, record.numbers = row, written.numbers
        record.kept = 0.0 if kept is None else kept
        record.of_speeds = int(written.coupling.of_speeds or kept is None)
        if row >= 0:
            rows[row].of_speeds = record.of_speeds
        for hinge in written.coupling.hinges:
            if hinge.position in frames and row >= 0:
                sides = side(hinge.inboard, row), side(hinge.outboard, row)
                own.setdefault(hinge.position, []).append(
                    (row, *sides, written.columns[hinge.position])
                )
    for frame, entries in own.items():
        looped[frame].n_own, looped[frame].own = len(entries), memory.new("mstmm_own[]", entries)
    model.couplings, model.n_couplings = records, len(couplings)
    model.coupling_tape = memory.expression(system.coupling_kernel)
