"""Rows of closed loops one by one, in the order in which a sweep closes them, and what it keeps.

Bodies are places in the tree here, -1 the ground.  The graph plans groups of rows; in a group every
row is coupled with all others, and the first is closed first.
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
    """A row of group `group` that is closed on `body`; `others` are the rows still open with which
    it is coupled, ascending."""

    group: int
    body: int
    others: tuple[int, ...]


class RowPlan:
    """`rows` as they close, `of` the rows of each group, `pending` by body the rows that pass its
    inboard hinge, ascending."""

    def __init__(self, plan: ClosurePlan) -> None:
        self.of: list[range] = [range(0)] * len(plan.groups)
        behind = 0
        for one in plan.closings:
            count = plan.groups[one.group].count
            self.of[one.group], behind = range(behind, behind + count), behind + count
        self.rows = [row for one in plan.closings for row in self._closed(one)]
        self.pending = {
            body: self._expanded(groups) for body, groups in enumerate(plan.pending) if groups
        }

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Pairs of different rows that share an entry of L."""
        return [(row, other) for row, one in enumerate(self.rows) for other in one.others]

    def _expanded(self, groups: Sequence[int]) -> list[int]:
        return sorted(row for group in groups for row in self.of[group])

    def _closed(self, one: GroupClosure) -> list[Row]:
        own, coupled = self.of[one.group], self._expanded(one.coupled)
        return [Row(one.group, one.body, (*own[k + 1 :], *coupled)) for k in range(len(own))]


def plan_rows(parents: Sequence[int], groups: Sequence[RowGroup]) -> RowPlan:
    """How groups of rows between places of a tree close, in which bodies hang on their parents."""
    hinges = tuple(Edge(parent, body, 0) for body, parent in enumerate(parents))
    mechanism = MechanismGraph(len(parents), hinges, tuple(groups))
    return RowPlan(plan_closures(mechanism, tuple(range(len(parents)))))


def row_groups(parents: Sequence[int], system: System) -> list[RowGroup]:
    """The groups of rows of a system: of its closures, then of the couplings that have one."""
    groups = [
        RowGroup((parents[one.frame], one.outboard), len(one.directions)) for one in system.closures
    ]
    ends = (
        tuple(end for hinge in one.hinges for end in (hinge.inboard, hinge.outboard))
        for one in system.couplings if not one.repeats
    )  # fmt: skip
    return groups + [RowGroup(pair, 1) for pair in ends]
