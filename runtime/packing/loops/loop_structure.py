"""Closed loops in the structure of fused code."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

from mstmm.ir.scene_structure import (
    COUPLING_NUMBERS,
    BodyStructure,
    ClosureStructure,
    CouplingStructure,
    Entries,
    RowStructure,
)

from ..system import ClosureNumbers, CouplingNumbers, System
from .flexible_row_plan import FlexibleRowPlan
from .row_plan import row_groups


class EntrySorter(Protocol):
    """Function that sorts numbers into structural constants and indices of p."""

    def __call__(self, values: Iterable[float], axes: bool = False) -> Entries: ...


def with_loops(
    bodies: Sequence[BodyStructure], system: System, sort: EntrySorter, floors: Sequence[float]
) -> tuple[
    tuple[BodyStructure, ...], tuple[ClosureStructure, ...], tuple[RowStructure, ...],
    tuple[CouplingStructure, ...],
]:  # fmt: skip
    """Bodies with pending rows, closures in the order of their frames, rows, and couplings.

    `floors` are the pivots (rows,) below which they count as rounding; without them it is zero.
    """
    plan = FlexibleRowPlan(system, row_groups([body.parent for body in bodies], system))
    inertia: dict[int, Entries] = {}
    closures = [
        _closure(closure, plan.rows_by_group[group], bodies[closure.frame], sort, inertia)
        for group, closure in enumerate(system.closures)
    ]
    coupling_rows = (rows[0] for rows in plan.rows_by_group[len(closures) :])
    couplings = tuple(
        _coupling_structure(coupling, -1 if coupling.repeats else next(coupling_rows), bodies, sort)
        for coupling in system.couplings
    )
    of_speeds = {
        row
        for group, closure in enumerate(system.closures)
        for row, direction in zip(plan.rows_by_group[group], closure.directions, strict=True)
        if direction in closure.speed_directions
    }
    of_speeds |= {coupling.row for coupling in couplings if coupling.of_speeds}
    rests: dict[int, int] = {}
    for group, closure in enumerate(system.closures):
        if closure.choice is not None:
            without_rotors = [row for row in plan.rows_by_group[group] if row not in inertia]
            rests |= {row: closure.choice[0] + k for k, row in enumerate(without_rotors)}
    rows = tuple(
        RowStructure(
            row.body, row.others, sort(floors[number : number + 1]), inertia.get(number, ()),
            number in of_speeds, rests.get(number, -1),
        )
        for number, row in enumerate(plan.rows)
    )  # fmt: skip
    closures.sort(key=lambda closure: closure.frame)
    return _with_pending_rows(bodies, plan), tuple(closures), rows, couplings


def _coupling_structure(
    coupling: CouplingNumbers, row: int, bodies: Sequence[BodyStructure], sort: EntrySorter
) -> CouplingStructure:
    columns, column = list[tuple[int, int]](), coupling.first + len(COUPLING_NUMBERS)
    for hinge in coupling.hinges:
        columns.append((hinge.position, column))
        column += bodies[hinge.position].nu
    kept = sort(() if coupling.constant is None else (coupling.constant,))
    of_speeds = coupling.of_speeds or coupling.constant is None
    return CouplingStructure(row, coupling.first, of_speeds, kept, tuple(columns))


def _with_pending_rows(
    bodies: Sequence[BodyStructure], plan: FlexibleRowPlan
) -> tuple[BodyStructure, ...]:
    def with_rows(place: int, body: BodyStructure) -> BodyStructure:
        pending, bent = plan.pending.get(place, ()), plan.modal_rows.get(place, ())
        return replace(body, pending=tuple(pending), bent=tuple(bent)) if pending or bent else body

    return tuple(with_rows(place, body) for place, body in enumerate(bodies))


def _closure(
    closure: ClosureNumbers,
    own_rows: range,
    frame: BodyStructure,
    sort: EntrySorter,
    inertia: dict[int, Entries],
) -> ClosureStructure:
    """Structure of a closure; adds the inertia of rotors by row to `inertia`."""
    rows = [-1 if direction < closure.asked else -2 for direction in range(6)]
    for row, direction in zip(own_rows, closure.directions, strict=True):
        rows[direction] = row
        if direction < frame.nu and not frame.imposed[direction]:
            inertia[row] = (frame.rotor[direction],)
    return ClosureStructure(
        closure.frame, closure.outboard, sort(closure.turn, axes=True), sort(closure.end),
        tuple(rows), closure.kind, (*sort(closure.p[:2]), *sort(closure.p[2:], axes=True)),
    )  # fmt: skip
