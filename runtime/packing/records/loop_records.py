"""C records of closed loops and couplings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.graph.mechanism_graph import GROUND

from ...kernels import prebuilt_kernels
from ...kernels.c_records import CRecords, Memory
from ..row_plan import FlexibleRowPlan, row_groups
from ..system import ClosureNumbers, CouplingNumbers, System
from ..system_variants import LOCKING_GAP_FRACTION, characteristic_length

# --- closed loops ---------------------------------------------------------------------------------


@dataclass(frozen=True)
class WrittenClosure:
    """Closure in the records; bodies are positions in the tree.

    Attributes:
        frame, inboard, outboard: massless frame, its parent, and the body that it must coincide
            with.
        kind: of the closure.
        numbers: offset of its numbers in those of all loops.
        rows: direction -> its constraint row, for those that have one.
    """

    frame: int
    inboard: int
    outboard: int
    kind: str
    numbers: int
    rows: dict[int, int]


class LoopRecords:
    """Records of closed loops.

    Attributes:
        offset: offset of their numbers in the workspace.
        closures, couplings: in the order of the system.
        body_records: records of the loops by body.
        count: number of constraint rows.
        width: largest number of rows pending across a hinge.
        optional_rows: rows that may be inactive because others are active instead.
    """

    def __init__(
        self,
        place: int,
        plan: FlexibleRowPlan,
        rows: Any,
        closures: tuple[WrittenClosure, ...],
        couplings: tuple[WrittenCoupling, ...],
        of_bodies: CRecords,
    ) -> None:
        self.offset, self.closures, self.couplings, self._rows = place, closures, couplings, rows
        self.body_records = of_bodies
        self.count = len(plan.rows)
        self.width = max(map(len, plan.pending.values()), default=0)
        self.optional_rows = [row for row in range(self.count) if rows[row].rest >= 0]

    def is_rotor_row(self, row: int) -> bool:
        """Whether a row is that of a rotor."""
        return bool(self._rows[row].softness > 0)

    def inactive_rows(self, memory: Array) -> NDArray[np.bool_]:
        """Mask (rows,) of the rows that are inactive according to memory."""
        inactive = np.zeros(self.count, bool)
        inactive[self.optional_rows] = (
            memory[[self._rows[row].rest for row in self.optional_rows]] > 0
        )
        return inactive

    def scale(self, row: int, mobility: float) -> None:
        """Set the mobility of a row, its scale in regularised solutions."""
        self._rows[row].mobility = mobility

    def set_pivot_floor(self, row: int, floor: float) -> None:
        """Set the pivot of a row below which it counts as rounding."""
        self._rows[row].floor = floor

    def copy_pivot_floors(self, other: LoopRecords) -> None:
        """Copy the pivot floors of all rows in common with other records of the same loops."""
        for own, reference in zip(self.closures, other.closures, strict=True):
            for direction in own.rows.keys() & reference.rows.keys():
                self.set_pivot_floor(own.rows[direction], other.floor(reference.rows[direction]))
        for coupling, same in zip(self.couplings, other.couplings, strict=True):
            self.set_pivot_floor(coupling.row, other.floor(same.row))

    def floor(self, row: int) -> float:
        """Pivot of a row below which it counts as rounding."""
        return float(self._rows[row].floor)

    @property
    def floors(self) -> list[float]:
        """Pivot floors of all rows."""
        return [self.floor(row) for row in range(self.count)]


def attach_loops(
    model: Any, system: System, memory: Memory, lib: Any, place: int
) -> tuple[int, LoopRecords]:
    """Write the constraint rows to the model, and reserve workspace at offset `place`.

    Returns the offset behind them, and the records.
    """
    return _LoopWriter(model, system, memory, lib).write(place)


class _RecordPool:
    """Records of one kind side by side, in the order in which a sweep reads them."""

    def __init__(self, memory: Memory, kind: str, count: int) -> None:
        self.records, self.used_count = memory.new(f"{kind}[]", max(1, count)), 0

    def next_records(self, count: int) -> Any:
        """Pointer to the next `count` records."""
        self.used_count += count
        return self.records + (self.used_count - count)


class _LoopWriter:
    """Writer of the loop records; offsets are relative to the numbers of the loops.

    Their order is: rows, a dump for columns on the ground, entries of L, columns; then the numbers
    that are not accumulated: couplings, y of the columns, closures.
    """

    def __init__(self, model: Any, system: System, memory: Memory, lib: Any) -> None:
        self.model, self.system, self.memory, self.lib = model, system, memory, lib
        self.parents = [int(parent) for parent in system.parents]
        self.plan = FlexibleRowPlan(system, row_groups(self.parents, system))
        self.row_numbers = int(lib.MSTMM_ROW)
        count = len(self.plan.rows)
        self.dump = count * self.row_numbers
        self.entries = {pair: self.dump + 6 + k for k, pair in enumerate(self.plan.pairs)}
        start = self.dump + 6 + len(self.entries)
        self.columns: dict[tuple[int, int], int] = {}
        self.pending = sorted(self.plan.pending.items())
        for body, rows in self.pending:
            for row in rows:
                self.columns[body, row] = start
                start += 6
        #: (body, row) -> offset of the row's column on the modes of the body.
        self.modes: dict[tuple[int, int], int] = {}
        for body, rows in self.plan.modal_rows.items():
            for row in rows:
                self.modes[body, row] = start
                start += self._mode_count(body)
        self.sums_offset = self.end_offset = start
        pending_counts = [len(rows) for _, rows in self.pending]
        pending_counts += map(len, self.plan.modal_rows.values())
        coupled_counts = [len(row.others) for row in self.plan.rows]
        pair_count = sum(n * (n + 1) // 2 for n in (*pending_counts, *coupled_counts))
        self.pools = {
            kind: _RecordPool(memory, kind, needed)
            for kind, needed in (
                ("mstmm_pending", sum(pending_counts)), ("mstmm_other", sum(coupled_counts)),
                ("int", pair_count), ("mstmm_closure", len(system.closures)),
            )
        }  # fmt: skip

    def write(self, place: int) -> tuple[int, LoopRecords]:
        """Write the records; returns the offset behind all numbers, and the records."""
        model, memory = self.model, self.memory
        records_of_bodies = CRecords(memory.ffi, "mstmm_looped", self.system.count)
        memory.keep_alive.append(records_of_bodies)
        looped = records_of_bodies.array
        coupling_rows = [rows[0] for rows in self.plan.rows_by_group[len(self.system.closures) :]]
        couplings = assign_couplings(model, self.system, coupling_rows, self._reserve)
        self.coupled = {
            (hinge, coupling.row): column
            for coupling in couplings if coupling.row >= 0
            for hinge, column in coupling.columns.items()
        }  # fmt: skip
        for body, rows in self.pending:
            looped[body].n_pending = len(rows)
            looped[body].pending = self._pending_records(body, rows)
        for body, rows in self.plan.modal_rows.items():
            looped[body].n_bent = len(rows)
            looped[body].bent = self._modal_records(body, rows)
        records = memory.new("mstmm_loop_row[]", max(1, len(self.plan.rows)))
        model.first_ground_row = len(self.plan.rows)
        for number, row in enumerate(self.plan.rows):
            others = self._coupled_records(row.body, row.others, number)
            memory.fill(
                records[number], row, release=-1, rest=-1, n_others=len(row.others), others=others
            )
            if row.body == GROUND:
                model.first_ground_row = min(model.first_ground_row, number)
            else:
                body_record = looped[row.body]
                if not body_record.n_rows:
                    body_record.first_row = number
                body_record.n_rows += 1
        written: dict[int, WrittenClosure] = {}
        for group, closure in self._closures_in_tree_order():
            looped[closure.frame].closure, written[group] = self._write_closure(
                group, closure, records
            )
        model.n_choices = sum(
            self._write_choice(group, closure, records)
            for group, closure in enumerate(self.system.closures)
        )
        attach_couplings(model, self.system, memory, couplings, records, looped, self._side_column)
        memory.fill(
            model, looped=looped, rows=records, n_rows=len(self.plan.rows),
            closures=self.pools["mstmm_closure"].records, n_closures=len(self.system.closures),
            loops=place, loops_summed=self.sums_offset,
            answer=place + self._reserve(self.system.nu),
            loops_apart=LOCKING_GAP_FRACTION * characteristic_length(self.system),
        )  # fmt: skip
        closures = tuple(written[group] for group in sorted(written))
        with_rows = tuple(coupling for coupling in couplings if coupling.row >= 0)
        loops = LoopRecords(place, self.plan, records, closures, with_rows, records_of_bodies)
        return place + self.end_offset, loops

    def _closures_in_tree_order(self) -> list[tuple[int, ClosureNumbers]]:
        """(group, closure) in the order in which a forward pass reaches both bodies of each."""
        return sorted(
            enumerate(self.system.closures), key=lambda item: max(item[1].frame, item[1].outboard)
        )

    def _reserve(self, count: int) -> int:
        """Offset of `count` new numbers."""
        first = self.end_offset
        self.end_offset += count
        return first

    def _column(self, body: int, row: int) -> int:
        """Offset of a row's column on a body; on the body where it closes it is part of the row."""
        return self.columns.get((body, row), row * self.row_numbers)

    def _entry(self, row: int, other: int) -> int:
        """Offset of an entry of L."""
        if row == other:
            return row * self.row_numbers + int(self.lib.MSTMM_ROW_PIVOT)
        return self.entries[min(row, other), max(row, other)]

    def _entries(self, row: int, others: Sequence[int]) -> Any:
        """Pointer to the offsets of the entries of L of a row with others."""
        offsets = self.pools["int"].next_records(len(others))
        offsets[0 : len(others)] = [self._entry(row, other) for other in others]
        return offsets

    def _pending_records(self, body: int, rows: list[int]) -> Any:
        """Records of the rows that pass the inboard hinge of a body."""
        records = self.pools["mstmm_pending"].next_records(len(rows))
        numbers = self.system.body(body)
        speeds, flexible_body = numbers.nu, numbers.section.frame if numbers.section else -1
        for k, row in enumerate(rows):
            self.memory.fill(
                records[k], row=row, column=self.columns[body, row],
                onward=self._column(self.parents[body], row), y=self._reserve(speeds),
                modes=self.modes.get((flexible_body, row), 0),
                tau=self.coupled.get((body, row), -1), pairs=self._entries(row, rows[: k + 1]),
            )  # fmt: skip
        return records

    def _modal_records(self, body: int, rows: list[int]) -> Any:
        """Records of the rows that pass the modes of a flexible body."""
        records = self.pools["mstmm_pending"].next_records(len(rows))
        for k, row in enumerate(rows):
            self.memory.fill(
                records[k], row=row, column=self._column(body, row), modes=self.modes[body, row],
                y=self._reserve(self._mode_count(body)), pairs=self._entries(row, rows[: k + 1]),
            )  # fmt: skip
        return records

    def _mode_count(self, body: int) -> int:
        modal = self.system.body(body).modal
        return 0 if modal is None else modal.n

    def _coupled_records(self, body: int, others: tuple[int, ...], number: int) -> Any:
        """Records of the open rows that row `number`, which closes on `body`, is coupled with."""
        records = self.pools["mstmm_other"].next_records(len(others))
        for k, other in enumerate(others):
            self.memory.fill(
                records[k], row=other, column=self._column(body, other),
                pair=self._entry(number, other), pairs=self._entries(other, others[: k + 1]),
            )  # fmt: skip
        return records

    def _write_closure(
        self, group: int, closure: ClosureNumbers, rows: Any
    ) -> tuple[Any, WrittenClosure]:
        record = self.pools["mstmm_closure"].next_records(1)
        self.memory.fill(
            record, closure, kind=getattr(self.lib, f"MSTMM_{closure.kind.upper()}"),
            numbers=self._reserve(int(self.lib.MSTMM_CLOSURE)),
            rows=[-1 if k < closure.asked else -2 for k in range(6)],
        )  # fmt: skip
        frame, row_by_direction = self.system.body(closure.frame), dict[int, int]()
        inboard = self.parents[closure.frame]
        for k, direction in enumerate(closure.directions):
            row = self.plan.rows_by_group[group][k]
            record.rows[direction] = row_by_direction[direction] = row
            record.inner[direction] = self._side_column(inboard, row)
            record.outer[direction] = self._side_column(closure.outboard, row)
            rows[row].of_speeds = int(direction in closure.speed_directions)
            if direction >= frame.nu:
                continue
            if frame.imposed[direction]:
                rows[row].release = frame.release
            else:
                rows[row].softness = 1.0 / frame.rotor[direction]
        return record, WrittenClosure(
            closure.frame, inboard, closure.outboard, closure.kind, record.numbers, row_by_direction
        )

    def _write_choice(self, group: int, closure: ClosureNumbers, rows: Any) -> bool:
        """Write the choice of active rows of a closure; returns whether it has one."""
        if closure.choice is None:
            return False
        first, count = closure.choice
        own_rows = [row for row in self.plan.rows_by_group[group] if not rows[row].softness]
        choice = self.memory.new("mstmm_choice *")
        choice.n, choice.count = len(own_rows), count
        for i, row in enumerate(own_rows):
            choice.rows[i] = row
            rows[row].rest = first + i
            for j in range(i):
                choice.pairs[i * (i - 1) // 2 + j] = self._entry(own_rows[j], row)
        rows[own_rows[0]].choice = choice
        return True

    def _side_column(self, body: int, row: int) -> int:
        """Offset of a row's column on a body; the dump on the ground."""
        return self.dump if body == GROUND else self._column(body, row)


# --- couplings ------------------------------------------------------------------------------------


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
        memory.fill(
            record, written, kept=kept or 0.0, of_speeds=written.coupling.of_speeds or kept is None
        )
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
    memory.fill(
        model, couplings=records, n_couplings=len(couplings), coupling_tape=system.coupling_kernel
    )
