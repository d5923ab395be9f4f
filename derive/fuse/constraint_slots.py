"""Slots of closed loops as graph nodes: row columns, known parts and entries of L.

A column is stored per body, because each hinge that it crosses transforms it.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace

from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import (
    COUPLING_NUMBERS,
    ClosureStructure,
    CouplingStructure,
    RowStructure,
    Structure,
)

from .slot_values import Slots, Subject

#: Fields of the subject that index the entry of L which a slot holds.
_ENTRY_INDICES = {
    "row.pivot": ("row", "row"), "other.L": ("row", "other"), "second.L": ("row", "second"),
    "both.L": ("other", "second"), "pair.L": ("row", "other"), "bent_pair.L": ("row", "other"),
}  # fmt: skip
#: Body role and row of each slot that holds a column.
_COLUMN_SLOTS = {
    "row.K": ("meeting", "row"), "other.K": ("meeting", "other"), "pending.K": ("body", "row"),
    "pending.onward": ("parent", "row"), "side.inner": ("parent", "row"),
    "side.outer": ("outboard", "row"), "own.inner": ("parent", "row"),
    "own.outer": ("outboard", "row"), "bent.K": ("body", "row"),
}  # fmt: skip
#: Quantity (K_f or Y) and row of each slot that couples a row to the modes of a flexible body.
_MODAL_SLOTS = {
    "pending.modes": ("K_f", "row"), "bent.modes": ("K_f", "row"),
    "bent_before.modes": ("K_f", "other"), "bent.y": ("Y", "row"),
}  # fmt: skip
#: Slot owner -> subject field that identifies the row.
_ROW_FIELDS = {
    "row": "row", "line": "row", "pending": "row", "own": "row", "coupling": "row",
    "bent": "row", "other": "other", "before": "other",
}  # fmt: skip
#: Pivot value below every floor, so that its row is never active.
_INACTIVE_PIVOT = 1e300


class RowSlots(Slots):
    """Slots including those of constraint rows.

    `level` is the corrected quantity of loops: "position_gap", "velocity_error" or "" (none).
    """

    level = ""

    def closure(self) -> ClosureStructure | None:
        """Closure whose frame is the current body; None if there is none."""
        return closure_at(self.state.structure, self.index)

    def row(self) -> RowStructure:
        """Current row."""
        return self.state.structure.rows[self.subject.row]

    def has_closure(self, kind: str) -> bool:
        """Whether the current body has a closure of this kind."""
        closure = self.closure()
        return closure is not None and closure.kind == kind

    def is_inactive(self) -> bool:
        """Whether the current row is inactive: no condition on it, or a zero pivot."""
        if self.level == "position_gap" and self.row().of_speeds:
            return True
        return self.get("row.pivot", 1)[0].value == 0

    def is_coupled(self) -> bool:
        """Whether the current row is a speed coupling that includes the current hinge."""
        return any(
            coupling.row == self.subject.row and self.index in dict(coupling.columns)
            for coupling in self.state.structure.couplings
        )

    def subjects(self, of: str) -> Iterator[Subject]:
        """Subjects that a `ForEach` step visits."""
        at, rows = self.subject, self.state.structure.rows
        if of in ("closings", "openings"):
            rows_of_body = [
                row_index for row_index, row in enumerate(rows) if row.body == self.index
            ]
            for row_index in rows_of_body if of == "closings" else reversed(rows_of_body):
                yield row_subject(rows, row_index)
        elif of == "pending":
            yield from (replace(at, row=row_index) for row_index in self.body.pending)
        elif of == "bent":
            yield from (replace(at, row=row_index) for row_index in self.body.bent)
        elif of in ("before", "bent_before"):
            passing = self.body.pending if of == "before" else self.body.bent
            end = passing.index(at.row) + 1
            yield from (replace(at, other=row_index) for row_index in passing[:end])
        elif of == "others":
            yield from (replace(at, other=row_index) for row_index in self.row().others)
        elif of == "own":
            own_rows = (
                coupling.row
                for coupling in self.state.structure.couplings
                for body, _ in coupling.columns
                if body == self.index
            )
            yield from (replace(at, row=row_index) for row_index in own_rows if row_index >= 0)
        elif of == "seconds":
            end = self.row().others.index(at.other) + 1
            yield from (replace(at, second=row_index) for row_index in self.row().others[:end])
        else:
            closure = self.closure()
            assert closure is not None
            for direction, row_index in enumerate(closure.rows):
                if row_index >= 0:
                    yield replace(at, row=row_index, direction=direction)

    def _key(self, slot: str) -> Hashable:
        at = self.subject
        if slot in _ENTRY_INDICES:
            return ("L", *sorted(getattr(at, field) for field in _ENTRY_INDICES[slot]))
        if slot in _COLUMN_SLOTS:
            role, field = _COLUMN_SLOTS[slot]
            return "K", at.roles[role], getattr(at, field)
        if slot in _MODAL_SLOTS:
            name, field = _MODAL_SLOTS[slot]
            return name, self.frame, getattr(at, field)
        owner, _, name = slot.partition(".")
        if owner in _ROW_FIELDS:
            body = self.index if name in ("y", "z", "tau") else None
            return name, body, getattr(at, _ROW_FIELDS[owner])
        return super()._key(slot)

    def _scene_data(self, slot: str) -> Nodes:
        f = self.state
        if slot in _ENTRY_INDICES:
            return self._entry(*(getattr(self.subject, field) for field in _ENTRY_INDICES[slot]))
        if slot == "row.floor":
            return f.entries(self.row().floor) or f.zeros(1)
        if slot in _COLUMN_SLOTS:
            return f.zeros(6)
        if slot in _MODAL_SLOTS:
            return f.zeros(self.modal.n)
        if slot.partition(".")[0] in _ROW_FIELDS:
            return f.zeros(1)
        return super()._scene_data(slot)

    def _entry(self, row_index: int, column_index: int) -> Nodes:
        """Initial entry of L: 1 / `soft` of a soft row, or a pivot that keeps it inactive.

        A rotor at rest gets -`_INACTIVE_PIVOT`, which is below every floor.
        """
        f = self.state
        row = f.structure.rows[row_index]
        soft = f.entries(row.soft) if row_index == column_index else []
        if row_index == column_index and row.rest >= 0:
            is_at_rest = f.graph.call("lt", f.zero, f.memory[row.rest])
            return [f.graph.select(is_at_rest, f.graph.constant(-_INACTIVE_PIVOT), f.zero)]
        return [f.one / soft[0]] if soft else f.zeros(1)

    def _closure(self, name: str) -> Nodes:
        closure = self.closure()
        assert closure is not None
        if name in ("J_A", "J_B"):
            return self.state.zeros(36)
        return self.state.entries({"turn": closure.turn, "end": closure.end, "p": closure.p}[name])


def closure_at(structure: Structure, index: int) -> ClosureStructure | None:
    """Closure whose frame is the body with this index; None for other bodies."""
    return next((closure for closure in structure.closures if closure.frame == index), None)


def row_subject(rows: tuple[RowStructure, ...], index: int) -> Subject:
    """Subject of a row, at the body where it closes."""
    body = rows[index].body
    return Subject({"body": body, "meeting": body}, row=index)


def coupling_inputs(slots: RowSlots) -> Iterator[tuple[CouplingStructure, Node]]:
    """Yield couplings with their errors at the current level; fill the slots that rows read."""
    state = slots.state
    level = {"position_gap": "gap", "velocity_error": "slip"}.get(slots.level, "drift")
    if state.structure.coupled is None:
        return
    numbers = state.expression(state.structure.coupled)
    for coupling in state.structure.couplings:
        values = dict(zip(COUPLING_NUMBERS, numbers[coupling.first :], strict=False))
        error = values[level]
        if level == "gap":
            error = (
                state.zero
                if coupling.of_speeds
                else error - sum(state.entries(coupling.kept), state.zero)
            )
        if coupling.row >= 0:
            for body, at in coupling.columns:
                slots.enter(Subject({"body": body}, row=coupling.row))
                nu = state.structure.bodies[body].nu
                slots.fill("pending.tau", numbers[at : at + nu])
            slots.fill("row.known", [error])
            slots.fill("coupling.time_rate", [values["time_rate"]])
        yield coupling, error
