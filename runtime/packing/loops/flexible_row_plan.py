"""Plan of constraint rows with flexible bodies, each of which is two nodes of the row tree.

The outer node is the floating frame, the inner one stands for its ends, which the modes move;
bodies on these ends are children of the inner node.  So rows are coupled across modes as across a
hinge, and a row between two ends of one body closes on the frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mstmm.graph.mechanism_graph import GROUND, RowGroup

from ..system import System
from .row_plan import plan_rows


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
        inner = {row.group: row.body for row in plan.rows if nodes.is_inner(row.body)}
        if inner:
            for group, node in inner.items():
                ends[group] = (*ends[group], node - 1)  # the outer node, so that it closes there
            plan = plan_rows(nodes.parents, _row_groups(ends, counts))
        self.rows_by_group, self.pairs = plan.rows_by_group, plan.pairs
        self.rows = [replace(row, body=nodes.body(row.body)) for row in plan.rows]
        self.pending, self.modal_rows = dict[int, list[int]](), dict[int, list[int]]()
        for node, rows in plan.pending.items():
            rows_by_body = self.modal_rows if nodes.is_inner(node) else self.pending
            rows_by_body[nodes.body(node)] = rows


class _RowTree:
    """Tree with two nodes for each flexible body; `parents` are the parents of the nodes."""

    def __init__(self, system: System) -> None:
        self._first, self._body = list[int](), list[int]()
        is_flexible = system.rows(lambda body: body.modal is not None).tolist()
        for body, flexible in enumerate(is_flexible):
            self._first.append(len(self._body))
            self._body += [body] * (2 if flexible else 1)
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


def _row_groups(ends: Sequence[tuple[int, ...]], counts: Sequence[int]) -> list[RowGroup]:
    return [RowGroup(bodies, count) for bodies, count in zip(ends, counts, strict=True)]
