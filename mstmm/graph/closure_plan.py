"""Plan of loop closures: rows pending across each hinge, and the order of their closure.

Rows close at the lowest common ancestor of their ends.  There their matrix has the rank of the
rows, and no hinge inboard of it can change that matrix.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from .mechanism_graph import GROUND, MechanismGraph, Paths, RowGroup, Tree, pending_cost
from .spanning_tree import spanning_tree

#: For each group the groups it is coupled with.
Adjacency = list[set[int]]


@dataclass(frozen=True, slots=True)
class GroupClosure:
    """Closure of a group of rows at `body` (-1: the ground).

    `coupled` are the groups still open that share a block of L with it, ascending.  Some of them
    close later at this body, the others stay pending.
    """

    group: int
    body: int
    coupled: tuple[int, ...]


@dataclass(frozen=True)
class ClosurePlan:
    """Spanning tree of a mechanism and the closures of its loops.

    `groups` are the groups of rows: those of the cut hinges that have any, in hinge order, then
    the other rows of the mechanism in their order.  `cut_of` are the hinges of the former.  `tree`
    gives the inboard hinge of each body, `cut` all other hinges.  `pending` gives for each body the
    groups that pass its inboard hinge, ascending.  `closings` are in the order of the backward
    pass: outboard bodies first.
    """

    mechanism: MechanismGraph
    tree: Tree
    cut: tuple[int, ...]
    cut_of: tuple[int, ...]
    groups: tuple[RowGroup, ...]
    pending: tuple[tuple[int, ...], ...]
    closings: tuple[GroupClosure, ...]

    @property
    def rows(self) -> int:
        """Number of constraint rows of all closures."""
        return sum(group.count for group in self.groups)

    @cached_property
    def pending_rows(self) -> tuple[int, ...]:
        """Number of rows pending across the inboard hinge of each body."""
        return tuple(sum(self.groups[g].count for g in groups) for groups in self.pending)

    @property
    def front(self) -> int:
        """Largest number of rows pending across one hinge."""
        return max(self.pending_rows, default=0)

    @property
    def work(self) -> int:
        """Cost that the tree minimises: sum of m^2 + 3 m over all hinges with m pending rows."""
        return sum(map(pending_cost, self.pending_rows))

    def loop(self, cut: int) -> tuple[int, ...]:
        """Hinges of the loop that a cut hinge closes, in order around the loop, itself first."""
        hinges = self.mechanism.hinges
        paths: list[list[int]] = []
        for body in (hinges[cut].outboard, hinges[cut].inboard):
            paths.append([])
            while body != GROUND:
                paths[-1].append(self.tree[body])
                body = hinges[self.tree[body]].inboard
        outboard, inboard = paths
        while outboard and inboard and outboard[-1] == inboard[-1]:
            outboard.pop()
            inboard.pop()
        return (cut, *outboard, *reversed(inboard))

    @cached_property
    def blocks(self) -> tuple[tuple[int, int], ...]:
        """Pairs of groups with a nonzero block of L, diagonal pairs included, in closing order."""
        return tuple(
            (closing.group, coupled)
            for closing in self.closings
            for coupled in (closing.group, *closing.coupled)
        )


def closure_plan(mechanism: MechanismGraph) -> ClosurePlan:
    """Choose the tree of least cost and plan its loop closures.

    Raises ValueError where no tree reaches every body.
    """
    return plan_closures(mechanism, spanning_tree(mechanism))


def plan_closures(mechanism: MechanismGraph, tree: Tree) -> ClosurePlan:
    """Plan the loop closures of a given tree."""
    cut_hinges = mechanism.cuts(tree)
    group_hinges = tuple(hinge for hinge in cut_hinges if mechanism.hinges[hinge].rows)
    groups = (*(mechanism.groups[hinge] for hinge in group_hinges), *mechanism.constraint_groups)
    paths = Paths(mechanism, tree)
    pending: list[list[int]] = [[] for _ in range(mechanism.bodies)]
    groups_by_body: dict[int, list[int]] = {}
    for number, group in enumerate(groups):
        for body, _ in paths.crossed_bodies(group):
            pending[body].append(number)
        groups_by_body.setdefault(paths.closing_body(group.ends), []).append(number)
    closures = tuple(_order_closures(paths, groups, pending, groups_by_body))
    return ClosurePlan(
        mechanism, tree, cut_hinges, group_hinges, groups, tuple(map(tuple, pending)), closures
    )


def _order_closures(
    paths: Paths,
    groups: tuple[RowGroup, ...],
    pending: list[list[int]],
    closing: dict[int, list[int]],
) -> Iterator[GroupClosure]:
    """Closures in elimination order; groups whose rows pass the same hinge are coupled."""
    adjacency: Adjacency = [set() for _ in groups]
    rows = [group.count for group in groups]
    for body in (*reversed(paths.order), GROUND):
        if body in closing:
            for group, coupled in elimination_order(closing[body], adjacency, rows):
                yield GroupClosure(group, body, coupled)
        if body != GROUND:
            for first_group, second_group in combinations(pending[body], 2):
                adjacency[first_group].add(second_group)
                adjacency[second_group].add(first_group)


# --- minimum-degree ordering ----------------------------------------------------------------------


def elimination_order(
    groups: Iterable[int], couplings: Adjacency, rows: Sequence[int]
) -> list[tuple[int, tuple[int, ...]]]:
    """Order groups by minimum degree: (group, groups coupled with it when it is eliminated).

    The degree of a group is the number of rows coupled with it; ties go to the lower group number.
    Eliminating a group couples all groups that were coupled with it.  `couplings` is updated in
    place, also for the groups that are not eliminated.
    """
    remaining = set(groups)
    heap = [(sum(rows[neighbour] for neighbour in couplings[g]), g) for g in remaining]
    heapq.heapify(heap)
    order = []
    while heap:
        degree, group = heapq.heappop(heap)
        coupled = couplings[group]
        if group not in remaining or degree != sum(rows[neighbour] for neighbour in coupled):
            continue
        remaining.discard(group)
        order.append((group, tuple(sorted(coupled))))
        for neighbour in coupled:
            couplings[neighbour] |= coupled
            couplings[neighbour] -= {group, neighbour}
        for neighbour in coupled & remaining:
            heapq.heappush(heap, (sum(rows[index] for index in couplings[neighbour]), neighbour))
    return order
