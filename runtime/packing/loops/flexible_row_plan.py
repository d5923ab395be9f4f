"""The tree of rows: every flexible body is two places, its frame and what its modes move.

What hangs on its ends hangs on the second, so that rows are coupled across modes as across a hinge,
and a row between two ends closes on the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mstmm.graph.mechanism_graph import GROUND, RowGroup

from ..system import System
from .row_plan import plan_rows


class FlexibleRowPlan:
    """A plan of rows by bodies: `rows`, `of`, `pairs` and `pending` as of `RowPlan`; `bent` are the
    rows that pass the modes of a flexible body, ascending."""

    def __init__(self, system: System, groups: Sequence[RowGroup]) -> None:
        places = _Places(system)
        ends = [tuple(map(places.outer, group.ends)) for group in groups]
        counts = [group.count for group in groups]
        plan = plan_rows(places.parents, _rows(ends, counts))
        inside = {row.group: row.body for row in plan.rows if places.is_inner(row.body)}
        if inside:
            for group, place in inside.items():
                ends[group] = (*ends[group], place - 1)
            plan = plan_rows(places.parents, _rows(ends, counts))
        self.of, self.pairs = plan.of, plan.pairs
        self.rows = [replace(row, body=places.body(row.body)) for row in plan.rows]
        self.pending, self.bent = dict[int, list[int]](), dict[int, list[int]]()
        for place, rows in plan.pending.items():
            passed = self.bent if places.is_inner(place) else self.pending
            passed[places.body(place)] = rows


class _Places:
    """Places of the tree of rows; `parents` are theirs."""

    def __init__(self, system: System) -> None:
        self._first, self._body = list[int](), list[int]()
        for body, bends in enumerate(system.rows(lambda one: one.modal is not None).tolist()):
            self._first.append(len(self._body))
            self._body += [body] * (2 if bends else 1)
        last = [*self._first[1:], len(self._body)]
        self.parents = [self._first[body] for body in self._body]
        for body, parent in enumerate(system.parents.tolist()):
            self.parents[self._first[body]] = GROUND if parent == GROUND else last[parent] - 1

    def outer(self, body: int) -> int:
        """The place whose inboard hinge is that of a body."""
        return GROUND if body == GROUND else self._first[body]

    def body(self, place: int) -> int:
        """The body at a place."""
        return GROUND if place == GROUND else self._body[place]

    def is_inner(self, place: int) -> bool:
        """Whether it is what the modes of a flexible body move."""
        return place != GROUND and self._first[self._body[place]] != place


def _rows(ends: Sequence[tuple[int, ...]], counts: Sequence[int]) -> list[RowGroup]:
    return [RowGroup(each, count) for each, count in zip(ends, counts, strict=True)]
