"""Plan of single constraint rows, in the order in which a sweep closes them.

Bodies are positions in the tree, -1 the ground.  The graph plans groups of rows; in a group every
row is coupled with all others, and the first is closed first.  Each flexible body is two nodes of
the row tree: the outer node is the floating frame, the inner one stands for its ends, which the
modes move; bodies on these ends are children of the inner node.  So rows are coupled across modes
as across a hinge, and a row between two ends of one body closes on the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mstmm.graph.closure_plan import ClosurePlan, GroupClosure, plan_closures
from mstmm.graph.mechanism_graph import GROUND, Edge, MechanismGraph, RowGroup

from .system import System


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


# --- flexible bodies ------------------------------------------------------------------------------


class FlexibleRowPlan:
    """Row plan in terms of bodies.

    Attributes:
        rows, rows_by_group, pairs, pending: as in `RowPlan`.
        modal_rows: flexible body -> rows that pass its modes, ascending.
    """

    def __init__(self, system: System, groups: Sequence[RowGroup]) -> None:
        nodes = _RowTree(system)
        ends = [tuple(map(nodes.outer_node, group.ends)) for group in groups]
        counts = [group.count for group in groups]
        plan = plan_rows(nodes.parents, _row_groups(ends, counts))
        outer = {row.group: nodes.outer_of_inner(row.body) for row in plan.rows}
        if any(node is not None for node in outer.values()):
            for group, node in outer.items():
                if node is not None:
                    ends[group] = (*ends[group], node)  # so that it closes there
            plan = plan_rows(nodes.parents, _row_groups(ends, counts))
        self.rows_by_group, self.pairs = plan.rows_by_group, plan.pairs
        self.rows = [replace(row, body=nodes.body(row.body)) for row in plan.rows]
        self.pending, self.modal_rows = dict[int, list[int]](), dict[int, list[int]]()
        for node, rows in plan.pending.items():
            rows_by_body = self.modal_rows if nodes.is_inner(node) else self.pending
            rows_by_body[nodes.body(node)] = rows


class _RowTree:
    """Tree with two nodes for each flexible body; `parents` are the parents of the nodes.

    Rows cannot close inside a flexible body: at its inner node, or at a station of an exact beam.
    """

    def __init__(self, system: System) -> None:
        self._first, self._body = list[int](), list[int]()
        is_flexible = system.rows(lambda body: body.modal is not None).tolist()
        for body, flexible in enumerate(is_flexible):
            self._first.append(len(self._body))
            self._body += [body] * (2 if flexible else 1)
        #: Station -> its flexible body.
        self._frames = _frames_of_stations(system)
        last = [*self._first[1:], len(self._body)]
        self.parents = [self._first[body] for body in self._body]
        for body, parent in enumerate(system.parents.tolist()):
            self.parents[self._first[body]] = GROUND if parent == GROUND else last[parent] - 1

    def outer_node(self, body: int) -> int:
        """Node of a rigid body, or outer node of a flexible one."""
        return GROUND if body == GROUND else self._first[body]

    def body(self, node: int) -> int:
        """Body of a node."""
        return GROUND if node == GROUND else self._body[node]

    def is_inner(self, node: int) -> bool:
        """Whether a node is the inner one of a flexible body."""
        return node != GROUND and self._first[self._body[node]] != node

    def outer_of_inner(self, node: int) -> int | None:
        """Outer node of the flexible body inside which a node is; None for other nodes."""
        if self.is_inner(node):
            return node - 1
        frame = self._frames.get(self.body(node))
        return None if frame is None else self.outer_node(frame)


def _frames_of_stations(system: System) -> dict[int, int]:
    """Station of an exact beam with further segments outboard of it -> its flexible body."""
    frames: dict[int, int] = {}
    parents = system.parents.tolist()
    for place in np.flatnonzero(system.rows(lambda body: body.section is not None)).tolist():
        section = system.body(place).section
        if section is not None and section.is_segment and parents[place] != section.frame:
            frames[parents[place]] = section.frame
    return frames


def _row_groups(ends: Sequence[tuple[int, ...]], counts: Sequence[int]) -> list[RowGroup]:
    return [RowGroup(bodies, count) for bodies, count in zip(ends, counts, strict=True)]
