"""Slots of closed loops as nodes: columns, known parts and entries of L of the rows.

A column is kept body by body, since every hinge that it crosses makes another of it.
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

#: Whose entry of L a slot is: fields of the subject.
_PAIRS = {
    "row.pivot": ("row", "row"), "other.L": ("row", "other"), "second.L": ("row", "second"),
    "both.L": ("other", "second"), "pair.L": ("row", "other"), "bent_pair.L": ("row", "other"),
}  # fmt: skip
#: On which body a slot has a column, and of which row.
_COLUMNS = {
    "row.K": ("meeting", "row"), "other.K": ("meeting", "other"), "pending.K": ("body", "row"),
    "pending.onward": ("parent", "row"), "side.inner": ("parent", "row"),
    "side.outer": ("outboard", "row"), "own.inner": ("parent", "row"),
    "own.outer": ("outboard", "row"), "bent.K": ("body", "row"),
}  # fmt: skip
#: What of a row on the modes of the flexible body at hand a slot is, and of which row.
_ON_MODES = {
    "pending.modes": ("K_f", "row"), "bent.modes": ("K_f", "row"),
    "bent_before.modes": ("K_f", "other"), "bent.y": ("Y", "row"),
}  # fmt: skip
#: Numbers of one row, by the owner that tells which.
_OF_ROW = {
    "row": "row", "line": "row", "pending": "row", "own": "row", "coupling": "row",
    "bent": "row", "other": "other", "before": "other",
}  # fmt: skip
#: A pivot that nothing makes count.
_NEVER = 1e300


class RowSlots(Slots):
    """Slots, those of rows among them; `level` is what is corrected of closed loops, "" nothing."""

    level = ""

    def closure(self) -> ClosureStructure | None:
        """The closure whose frame the body at hand is."""
        return closure_at(self.state.structure, self.index)

    def row(self) -> RowStructure:
        """The row at hand."""
        return self.state.structure.rows[self.at.row]

    def closed_by(self, kind: str) -> bool:
        """Whether what closes here is of this kind."""
        closure = self.closure()
        return closure is not None and closure.kind == kind

    def rests(self) -> bool:
        """Whether nothing is asked of the row at hand, or nothing moves it."""
        if self.level == "gaping" and self.row().of_speeds:
            return True
        return self.get("row.pivot", 1)[0].value == 0

    def is_coupled(self) -> bool:
        """Whether the row at hand is a coupling of the speeds of the hinge at hand."""
        return any(
            one.row == self.at.row and self.index in dict(one.columns)
            for one in self.state.structure.couplings
        )

    def met(self, of: str) -> Iterator[Subject]:
        """The subjects of `Each`."""
        at, rows = self.at, self.state.structure.rows
        if of in ("closings", "openings"):
            here = [number for number, row in enumerate(rows) if row.body == self.index]
            for number in here if of == "closings" else reversed(here):
                yield row_subject(rows, number)
        elif of == "pending":
            yield from (replace(at, row=number) for number in self.body.pending)
        elif of == "bent":
            yield from (replace(at, row=number) for number in self.body.bent)
        elif of in ("before", "bent_before"):
            passing = self.body.pending if of == "before" else self.body.bent
            up_to = passing.index(at.row) + 1
            yield from (replace(at, other=number) for number in passing[:up_to])
        elif of == "others":
            yield from (replace(at, other=number) for number in self.row().others)
        elif of == "own":
            named = (one.row for one in self.state.structure.couplings for body, _ in one.columns
                     if body == self.index)  # fmt: skip
            yield from (replace(at, row=number) for number in named if number >= 0)
        elif of == "seconds":
            up_to = self.row().others.index(at.other) + 1
            yield from (replace(at, second=number) for number in self.row().others[:up_to])
        else:
            closure = self.closure()
            assert closure is not None
            for direction, number in enumerate(closure.rows):
                if number >= 0:
                    yield replace(at, row=number, direction=direction)

    def _key(self, slot: str) -> Hashable:
        at = self.at
        if slot in _PAIRS:
            return ("L", *sorted(getattr(at, whose) for whose in _PAIRS[slot]))
        if slot in _COLUMNS:
            role, whose = _COLUMNS[slot]
            return "K", at.roles[role], getattr(at, whose)
        if slot in _ON_MODES:
            name, whose = _ON_MODES[slot]
            return name, self.frame, getattr(at, whose)
        owner, _, name = slot.partition(".")
        if owner in _OF_ROW:
            body = self.index if name in ("y", "z", "tau") else None
            return name, body, getattr(at, _OF_ROW[owner])
        return super()._key(slot)

    def _given(self, slot: str) -> Nodes:
        f = self.state
        if slot in _PAIRS:
            return self._entry(*(getattr(self.at, whose) for whose in _PAIRS[slot]))
        if slot == "row.floor":
            return f.entries(self.row().floor) or f.zeros(1)
        if slot in _COLUMNS:
            return f.zeros(6)
        if slot in _ON_MODES:
            return f.zeros(self.modal.n)
        if slot.partition(".")[0] in _OF_ROW:
            return f.zeros(1)
        return super()._given(slot)

    def _entry(self, one: int, other: int) -> Nodes:
        """An entry of L before anything is added: a rotor gives way on its own row, and one at rest
        is below every floor."""
        f = self.state
        row = f.structure.rows[one]
        soft = f.entries(row.soft) if one == other else []
        if one == other and row.rest >= 0:
            rests = f.graph.call("lt", f.zero, f.memory[row.rest])
            return [f.graph.select(rests, f.graph.constant(-_NEVER), f.zero)]
        return [f.one / soft[0]] if soft else f.zeros(1)

    def _closure(self, name: str) -> Nodes:
        closure = self.closure()
        assert closure is not None
        if name in ("J_A", "J_B"):
            return self.state.zeros(36)
        return self.state.entries({"turn": closure.turn, "end": closure.end, "p": closure.p}[name])


def closure_at(structure: Structure, index: int) -> ClosureStructure | None:
    """The closure whose frame the body at a place is; None for other bodies."""
    return next((one for one in structure.closures if one.frame == index), None)


def row_subject(rows: tuple[RowStructure, ...], number: int) -> Subject:
    """A row, on the body where it closes."""
    body = rows[number].body
    return Subject({"body": body, "meeting": body}, row=number)


def coupling_inputs(slots: RowSlots) -> Iterator[tuple[CouplingStructure, Node]]:
    """Couplings, with what each lacks at the level at hand; their numbers are put where rows read
    them."""
    state, level = slots.state, {"gaping": "gap", "slipping": "slip"}.get(slots.level, "drift")
    if state.structure.coupled is None:
        return
    numbers = state.expression(state.structure.coupled)
    for one in state.structure.couplings:
        found = dict(zip(COUPLING_NUMBERS, numbers[one.first :], strict=False))
        lack = found[level]
        if level == "gap":
            lack = state.zero if one.of_speeds else lack - sum(state.entries(one.kept), state.zero)
        if one.row >= 0:
            for body, at in one.columns:
                slots.enter(Subject({"body": body}, row=one.row))
                nu = state.structure.bodies[body].nu
                slots.fill("pending.tau", numbers[at : at + nu])
            slots.fill("row.known", [lack])
            slots.fill("coupling.still", [found["still"]])
        yield one, lack
