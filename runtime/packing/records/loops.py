"""Closed loops -> C records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.graph.mechanism_graph import GROUND

from ...kernels.c_records import CRecords
from ..loops.flexible_row_plan import FlexibleRowPlan
from ..loops.row_plan import row_groups
from ..loops.system_variants import LOCKED, characteristic_length
from ..system import ClosureNumbers, System
from .couplings import WrittenCoupling, attach_couplings, place_couplings
from .memory import Memory


@dataclass(frozen=True)
class WrittenClosure:
    """What closes a loop: the place of its frame, those of its bodies, whose directions its rows
    are, where its numbers begin behind those of all loops, and the row of each direction that has
    one."""

    frame: int
    inboard: int
    outboard: int
    kind: str
    numbers: int
    rows: dict[int, int]


class LoopRecords:
    """Closed loops in the memory of C; `place` is where their numbers begin in the workspace,
    `of_bodies` what bodies have to do with them."""

    def __init__(
        self,
        place: int,
        plan: FlexibleRowPlan,
        rows: Any,
        closures: tuple[WrittenClosure, ...],
        couplings: tuple[WrittenCoupling, ...],
        of_bodies: CRecords,
    ) -> None:
        self.place, self.closures, self.couplings, self._rows = place, closures, couplings, rows
        self.of_bodies = of_bodies
        self.count = len(plan.rows)
        self.width = max(map(len, plan.pending.values()), default=0)
        #: Rows of which others may be met instead.
        self.chosen = [row for row in range(self.count) if rows[row].rest >= 0]

    def yields(self, row: int) -> bool:
        """Whether the row is that of a rotor."""
        return bool(self._rows[row].softness > 0)

    def resting(self, memory: Array) -> NDArray[np.bool_]:
        """Whether each row (rows,) is not met, by memory, because others are instead."""
        found = np.zeros(self.count, bool)
        found[self.chosen] = memory[[self._rows[row].rest for row in self.chosen]] > 0
        return found

    def scale(self, row: int, mobility: float) -> None:
        """Take this for the mobility of a row where rows give way."""
        self._rows[row].mobility = mobility

    def judge(self, row: int, floor: float) -> None:
        """Take pivots of a row up to `floor` for rounding."""
        self._rows[row].floor = floor

    def judge_as(self, other: LoopRecords) -> None:
        """Judge pivots of the rows that another plan of the same loops has as it does."""
        for mine, theirs in zip(self.closures, other.closures, strict=True):
            for direction in mine.rows.keys() & theirs.rows.keys():
                self.judge(mine.rows[direction], other.floor(theirs.rows[direction]))
        for one, same in zip(self.couplings, other.couplings, strict=True):
            self.judge(one.row, other.floor(same.row))

    def floor(self, row: int) -> float:
        """Up to where pivots of a row are rounding."""
        return float(self._rows[row].floor)

    @property
    def floors(self) -> list[float]:
        """The same of every row."""
        return [self.floor(row) for row in range(self.count)]


def attach_loops(
    model: Any, system: System, memory: Memory, lib: Any, place: int
) -> tuple[int, LoopRecords | None]:
    """Give the model the rows of its loops and a place for them in the workspace; returns the place
    behind them, and the records."""
    if not system.closes:
        return place, None
    return _Loops(model, system, memory, lib).write(place)


class _Shelf:
    """Records of one kind side by side, as a sweep meets them: it waits for memory."""

    def __init__(self, memory: Memory, kind: str, count: int) -> None:
        self.records, self.used = memory.new(f"{kind}[]", max(1, count)), 0

    def take(self, count: int) -> Any:
        """The next `count` of them."""
        self.used += count
        return self.records + (self.used - count)


class _Loops:
    """Numbers of loops lie behind the place that the model names, in this order: rows, a dump for
    columns on the ground, entries of L, columns, then what is no sum: couplings, y of the columns,
    closures.
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
        #: Columns on the modes of flexible bodies.
        self.modes: dict[tuple[int, int], int] = {}
        for body, rows in self.plan.bent.items():
            for row in rows:
                self.modes[body, row] = start
                start += self._modes_of(body)
        self.summed = self.end = start
        passing = [len(rows) for _, rows in self.pending]
        passing += map(len, self.plan.bent.values())
        staying = [len(row.others) for row in self.plan.rows]
        pairs = sum(n * (n + 1) // 2 for n in (*passing, *staying))
        self.shelves = {
            kind: _Shelf(memory, kind, needed)
            for kind, needed in (
                ("mstmm_pending", sum(passing)), ("mstmm_other", sum(staying)), ("int", pairs),
                ("mstmm_closure", len(system.closures)),
            )
        }  # fmt: skip

    def write(self, place: int) -> tuple[int, LoopRecords]:
        model, memory = self.model, self.memory
        records_of_bodies = CRecords(memory.ffi, "mstmm_looped", self.system.count)
        memory.kept.append(records_of_bodies)
        looped = records_of_bodies.array
        behind = self.plan.of[len(self.system.closures) :]
        couplings = place_couplings(model, self.system, [rows[0] for rows in behind], self._take)
        self.coupled = {
            (hinge, one.row): at
            for one in couplings if one.row >= 0
            for hinge, at in one.columns.items()
        }  # fmt: skip
        for body, rows in self.pending:
            looped[body].n_pending = len(rows)
            looped[body].pending = self._pending(body, rows)
        for body, rows in self.plan.bent.items():
            looped[body].n_bent = len(rows)
            looped[body].bent = self._bent(body, rows)
        records = memory.new("mstmm_loop_row[]", max(1, len(self.plan.rows)))
        model.first_ground_row = len(self.plan.rows)
        for number, row in enumerate(self.plan.rows):
            records[number].body = row.body
            records[number].release = records[number].rest = -1
            records[number].n_others = len(row.others)
            records[number].others = self._others(row.body, row.others, number)
            if row.body == GROUND:
                model.first_ground_row = min(model.first_ground_row, number)
            else:
                at = looped[row.body]
                at.first_row = number if not at.n_rows else at.first_row
                at.n_rows += 1
        written: dict[int, WrittenClosure] = {}
        for group, closure in self._in_order():
            looped[closure.frame].closure, written[group] = self._closure(group, closure, records)
        chosen = [
            self._choice(group, one, records) for group, one in enumerate(self.system.closures)
        ]
        model.n_choices = sum(chosen)
        attach_couplings(model, self.system, memory, couplings, records, looped, self._side)
        model.looped, model.rows, model.n_rows = looped, records, len(self.plan.rows)
        model.closures = self.shelves["mstmm_closure"].records
        model.n_closures = len(self.system.closures)
        model.loops, model.loops_summed = place, self.summed
        model.answer = place + self._take(self.system.nu)
        model.loops_apart = LOCKED * characteristic_length(self.system)
        closures = tuple(written[group] for group in sorted(written))
        coupled = tuple(one for one in couplings if one.row >= 0)
        made = LoopRecords(place, self.plan, records, closures, coupled, records_of_bodies)
        return place + self.end, made

    def _in_order(self) -> list[tuple[int, ClosureNumbers]]:
        """Closures with their numbers, as a sweep from the root meets the bodies of each."""
        return sorted(
            enumerate(self.system.closures), key=lambda one: max(one[1].frame, one[1].outboard)
        )

    def _take(self, count: int) -> int:
        first = self.end
        self.end += count
        return first

    def _column(self, body: int, row: int) -> int:
        """Place of a row's column on a body: where it closes it is the row's own."""
        return self.columns.get((body, row), row * self.row_numbers)

    def _entry(self, one: int, other: int) -> int:
        """Place of an entry of L."""
        if one == other:
            return one * self.row_numbers + int(self.lib.MSTMM_ROW_PIVOT)
        return self.entries[min(one, other), max(one, other)]

    def _places(self, places: list[int]) -> Any:
        found = self.shelves["int"].take(len(places))
        found[0 : len(places)] = places
        return found

    def _pending(self, body: int, rows: list[int]) -> Any:
        records = self.shelves["mstmm_pending"].take(len(rows))
        speeds = self.system.body(body).nu
        for k, row in enumerate(rows):
            records[k].row = row
            records[k].column = self.columns[body, row]
            records[k].onward = self._column(self.parents[body], row)
            records[k].modes = self.modes.get((self.parents[body], row), 0)
            records[k].y = self._take(speeds)
            records[k].tau = self.coupled.get((body, row), -1)
            records[k].pairs = self._places([self._entry(row, other) for other in rows[: k + 1]])
        return records

    def _bent(self, body: int, rows: list[int]) -> Any:
        records = self.shelves["mstmm_pending"].take(len(rows))
        for k, row in enumerate(rows):
            records[k].row = row
            records[k].column = self._column(body, row)
            records[k].modes = self.modes[body, row]
            records[k].y = self._take(self._modes_of(body))
            records[k].pairs = self._places([self._entry(row, other) for other in rows[: k + 1]])
        return records

    def _modes_of(self, body: int) -> int:
        modal = self.system.body(body).modal
        return 0 if modal is None else modal.n

    def _others(self, body: int, others: tuple[int, ...], number: int) -> Any:
        records = self.shelves["mstmm_other"].take(len(others))
        for k, other in enumerate(others):
            records[k].row = other
            records[k].column = self._column(body, other)
            records[k].pair = self._entry(number, other)
            records[k].pairs = self._places([self._entry(other, x) for x in others[: k + 1]])
        return records

    def _closure(
        self, group: int, closure: ClosureNumbers, rows: Any
    ) -> tuple[Any, WrittenClosure]:
        record = self.shelves["mstmm_closure"].take(1)
        record.frame, record.outboard = closure.frame, closure.outboard
        record.turn, record.end = list(closure.turn), list(closure.end)
        record.kind = getattr(self.lib, f"MSTMM_{closure.kind.upper()}")
        for k, number in enumerate(closure.p):
            record.p[k] = number
        record.numbers = self._take(int(self.lib.MSTMM_CLOSURE))
        record.rows = [-1 if k < closure.asked else -2 for k in range(6)]
        body, own = self.system.body(closure.frame), dict[int, int]()
        inboard = self.parents[closure.frame]
        for k, direction in enumerate(closure.directions):
            row = self.plan.of[group][k]
            record.rows[direction] = own[direction] = row
            record.inner[direction] = self._side(inboard, row)
            record.outer[direction] = self._side(closure.outboard, row)
            rows[row].of_speeds = int(direction in closure.of_speeds)
            if direction >= body.nu:
                continue
            if body.imposed[direction]:
                rows[row].release = body.release
            else:
                rows[row].softness = 1.0 / body.rotor[direction]
        return record, WrittenClosure(
            closure.frame, inboard, closure.outboard, closure.kind, record.numbers, own
        )

    def _choice(self, group: int, closure: ClosureNumbers, rows: Any) -> bool:
        """Tell the rows of a closure of which only so many count, and whether there are some."""
        if closure.choice is None:
            return False
        first, count = closure.choice
        own = [row for row in self.plan.of[group] if not rows[row].softness]
        choice = self.memory.new("mstmm_choice *")
        choice.n, choice.count = len(own), count
        for i, row in enumerate(own):
            choice.rows[i] = row
            rows[row].rest = first + i
            for j in range(i):
                choice.pairs[i * (i - 1) // 2 + j] = self._entry(own[j], row)
        rows[own[0]].choice = choice
        return True

    def _side(self, body: int, row: int) -> int:
        """Place of a row's column on a body, a dump on the ground."""
        return self.dump if body == GROUND else self._column(body, row)
