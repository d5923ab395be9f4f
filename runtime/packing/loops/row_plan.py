"""Plan of single constraint rows, in the order in which a sweep closes them.

Bodies are positions in the tree here, -1 the ground.  The graph plans groups of rows; in a group
every row is coupled with all others, and the first is closed first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from mstmm.graph.closure_plan import ClosurePlan, GroupClosure, plan_closures
from mstmm.graph.mechanism_graph import Edge, MechanismGraph, RowGroup

from ..system import System


@dataclass(frozen=True, slots=True)
class Row:
    """Constraint row of a group.

    Attributes:
        group: number of its group.
        body: body on which it closes.
        others: rows still open that it is coupled with, ascending.
    """

    group: int
    body: int
    others: tuple[int, ...]


class RowPlan:
    """Plan of all rows.

    Attributes:
        rows: in the order of their closure.
        rows_by_group: numbers of the rows of each group.
        pending: body -> rows that pass its inboard hinge, ascending.
    """

    def __init__(self, plan: ClosurePlan) -> None:
        self.rows_by_group: list[range] = [range(0)] * len(plan.groups)
        first = 0
        for closing in plan.closings:
            count = plan.groups[closing.group].count
            self.rows_by_group[closing.group], first = range(first, first + count), first + count
        self.rows = [row for closing in plan.closings for row in self._group_rows(closing)]
        self.pending = {
            body: self._row_numbers(groups) for body, groups in enumerate(plan.pending) if groups
        }

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Pairs of different rows that share an entry of L."""
        return [(number, other) for number, row in enumerate(self.rows) for other in row.others]

    def _row_numbers(self, groups: Sequence[int]) -> list[int]:
        return sorted(row for group in groups for row in self.rows_by_group[group])

    def _group_rows(self, closing: GroupClosure) -> list[Row]:
        own, coupled = self.rows_by_group[closing.group], self._row_numbers(closing.coupled)
        return [
            Row(closing.group, closing.body, (*own[k + 1 :], *coupled)) for k in range(len(own))
        ]


def plan_rows(parents: Sequence[int], groups: Sequence[RowGroup]) -> RowPlan:
    """Plan the closure of groups of rows in the tree with these parents."""
    hinges = tuple(Edge(parent, body, 0) for body, parent in enumerate(parents))
    mechanism = MechanismGraph(len(parents), hinges, tuple(groups))
    return RowPlan(plan_closures(mechanism, tuple(range(len(parents)))))


def row_groups(parents: Sequence[int], system: System) -> list[RowGroup]:
    """Groups of rows of a system: of its closures, then of the couplings that have a row."""
    groups = [
        RowGroup((parents[closure.frame], closure.outboard), len(closure.directions))
        for closure in system.closures
    ]
    ends = (
        tuple(end for hinge in coupling.hinges for end in (hinge.inboard, hinge.outboard))
        for coupling in system.couplings if not coupling.repeats
    )  # fmt: skip
    return groups + [RowGroup(pair, 1) for pair in ends]
