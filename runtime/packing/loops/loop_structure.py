"""Closed loops of a system -> their part of the structure of fused code."""

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
    """Sorts numbers into structural constants and places in p."""

    def __call__(self, values: Iterable[float], axes: bool = False) -> Entries: ...


def with_loops(
    bodies: Sequence[BodyStructure], system: System, sort: EntrySorter, floors: Sequence[float]
) -> tuple[
    tuple[BodyStructure, ...], tuple[ClosureStructure, ...], tuple[RowStructure, ...],
    tuple[CouplingStructure, ...],
]:  # fmt: skip
    """The bodies with the rows that are open across their hinges, closures in the order of their
    frames, rows, and couplings.  `floors` go by row; without them a pivot counts that is more than
    zero."""
    plan = FlexibleRowPlan(system, row_groups([body.parent for body in bodies], system))
    soft: dict[int, Entries] = {}
    closures = [
        _closure(one, plan.of[group], bodies[one.frame], sort, soft)
        for group, one in enumerate(system.closures)
    ]
    left = (of[0] for of in plan.of[len(closures) :])
    couplings = tuple(
        _coupling(one, -1 if one.repeats else next(left), bodies, sort) for one in system.couplings
    )
    of_speeds = {
        row
        for group, one in enumerate(system.closures)
        for row, direction in zip(plan.of[group], one.directions, strict=True)
        if direction in one.of_speeds
    }
    of_speeds |= {one.row for one in couplings if one.of_speeds}
    rests: dict[int, int] = {}
    for group, one in enumerate(system.closures):
        own = [number for number in plan.of[group] if number not in soft]
        if one.choice is not None:
            rests |= {row: one.choice[0] + k for k, row in enumerate(own)}
    rows = tuple(
        RowStructure(
            row.body, row.others, sort(floors[number : number + 1]), soft.get(number, ()),
            number in of_speeds, rests.get(number, -1),
        )
        for number, row in enumerate(plan.rows)
    )  # fmt: skip
    closures.sort(key=lambda one: one.frame)
    return _pending(bodies, plan), tuple(closures), rows, couplings


def _coupling(
    one: CouplingNumbers, row: int, bodies: Sequence[BodyStructure], sort: EntrySorter
) -> CouplingStructure:
    columns, at = list[tuple[int, int]](), one.first + len(COUPLING_NUMBERS)
    for hinge in one.hinges:
        columns.append((hinge.place, at))
        at += bodies[hinge.place].nu
    kept = sort(() if one.kept is None else (one.kept,))
    unasked = one.of_speeds or one.kept is None
    return CouplingStructure(row, one.first, unasked, kept, tuple(columns))


def _pending(bodies: Sequence[BodyStructure], plan: FlexibleRowPlan) -> tuple[BodyStructure, ...]:
    def passing(place: int, body: BodyStructure) -> BodyStructure:
        pending, bent = plan.pending.get(place, ()), plan.bent.get(place, ())
        return replace(body, pending=tuple(pending), bent=tuple(bent)) if pending or bent else body

    return tuple(passing(place, body) for place, body in enumerate(bodies))


def _closure(
    one: ClosureNumbers,
    own: range,
    frame: BodyStructure,
    sort: EntrySorter,
    soft: dict[int, Entries],
) -> ClosureStructure:
    """A closure; rows of rotors get their inertia in `soft`."""
    rows = [-1 if direction < one.asked else -2 for direction in range(6)]
    for row, direction in zip(own, one.directions, strict=True):
        rows[direction] = row
        if direction < frame.nu and not frame.imposed[direction]:
            soft[row] = (frame.rotor[direction],)
    return ClosureStructure(
        one.frame, one.outboard, sort(one.turn, axes=True), sort(one.end), tuple(rows), one.kind,
        (*sort(one.p[:2]), *sort(one.p[2:], axes=True)),
    )  # fmt: skip
