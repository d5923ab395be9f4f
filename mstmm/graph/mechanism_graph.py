"""Mechanism as a graph: bodies, hinges, constraint rows of each closure, and paths in a tree."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

GROUND = -1

#: A tree: for each body its inboard hinge.
Tree = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Edge:
    """Hinge as an edge from the body `inboard` (or the ground) to the body `outboard`.

    `rows` is its number of constraint rows if it is cut: 6 less its coordinates, plus one for each
    coordinate that is driven or carries rotor inertia.  `cut` True: it closes a loop; False: it is
    part of the tree; None: whichever costs less.
    """

    inboard: int
    outboard: int
    rows: int
    cut: bool | None = None


@dataclass(frozen=True, slots=True)
class RowGroup:
    """Group of constraint rows between the bodies `ends`, two or more.

    The ends of a coupling of hinges are the bodies on both sides of each hinge, cut or not: the
    row of a coordinate starts at its hinge.
    """

    ends: tuple[int, ...]
    count: int


@dataclass(frozen=True)
class MechanismGraph:
    """Bodies 0 to `bodies` - 1, the hinges between them, and the rows of other closures.

    A spanning tree has one inboard hinge for every body; the other hinges are cut.
    """

    bodies: int
    hinges: tuple[Edge, ...]
    constraint_groups: tuple[RowGroup, ...] = ()

    @cached_property
    def holders(self) -> tuple[tuple[int, ...], ...]:
        """For each body the candidates for its inboard hinge in a tree, in scene order."""
        optional_hinges: list[list[int]] = [[] for _ in range(self.bodies)]
        required_hinges: list[list[int]] = [[] for _ in range(self.bodies)]
        for hinge, edge in enumerate(self.hinges):
            if edge.cut is None:
                optional_hinges[edge.outboard].append(hinge)
            elif not edge.cut:
                required_hinges[edge.outboard].append(hinge)
        return tuple(
            tuple(required or optional)
            for required, optional in zip(required_hinges, optional_hinges, strict=True)
        )

    @cached_property
    def groups(self) -> tuple[RowGroup, ...]:
        """Row groups: those of every hinge if it were cut, then the other rows."""
        closures = (RowGroup((edge.inboard, edge.outboard), edge.rows) for edge in self.hinges)
        return (*closures, *self.constraint_groups)

    def cuts(self, tree: tuple[int, ...]) -> tuple[int, ...]:
        """Cut hinges: those that are not part of a tree."""
        tree_hinges = set(tree)
        return tuple(hinge for hinge in range(len(self.hinges)) if hinge not in tree_hinges)

    def closures(self, tree: tuple[int, ...]) -> tuple[int, ...]:
        """Indices of the groups that close with a tree: its cut hinges, then the other rows."""
        first_other = len(self.hinges)
        return (*self.cuts(tree), *range(first_other, first_other + len(self.constraint_groups)))


# --- paths in a tree ------------------------------------------------------------------------------


class Paths:
    """Parents, order and common ancestors of the bodies of a tree.

    `parent` is the inboard body of each body, -1 for the ground; `order` lists the bodies, each
    branch contiguous, parents first.
    """

    def __init__(self, mechanism: MechanismGraph, tree: Tree) -> None:
        self.parent = [mechanism.hinges[hinge].inboard for hinge in tree]
        children: list[list[int]] = [[] for _ in range(mechanism.bodies + 1)]
        for body, parent in enumerate(self.parent):
            children[parent].append(body)
        self.order: list[int] = []
        stack = children[GROUND][::-1]
        while stack:
            body = stack.pop()
            self.order.append(body)
            stack.extend(reversed(children[body]))

    @cached_property
    def _rank(self) -> list[int]:
        """Index of every body in `order`; last entry: the ground, which comes first."""
        rank = [GROUND] * (len(self.parent) + 1)
        for index, body in enumerate(self.order):
            rank[body] = index
        return rank

    @cached_property
    def _heads(self) -> list[int]:
        """First body of the heavy path of each body.

        Each body continues the path of its largest child.  A path to the ground therefore changes
        heavy paths O(log N) times.
        """
        size = [1] * (len(self.parent) + 1)
        for body in reversed(self.order):
            size[self.parent[body]] += size[body]
        heavy_children = [GROUND] * (len(self.parent) + 1)
        for body in self.order:
            parent = self.parent[body]
            if heavy_children[parent] == GROUND or size[body] > size[heavy_children[parent]]:
                heavy_children[parent] = body
        heads = list(range(len(self.parent)))
        for body in self.order:
            parent = self.parent[body]
            if parent != GROUND and heavy_children[parent] == body:
                heads[body] = heads[parent]
        return heads

    def common_ancestor(self, one: int, other: int) -> int:
        """Lowest common ancestor of two bodies; a body is its own ancestor."""
        rank, heads = self._rank, self._heads
        while one != GROUND and other != GROUND and heads[one] != heads[other]:
            if rank[heads[one]] > rank[heads[other]]:
                one = self.parent[heads[one]]
            else:
                other = self.parent[heads[other]]
        return one if rank[one] < rank[other] else other

    def closing_body(self, ends: Iterable[int]) -> int:
        """Lowest common ancestor of all ends."""
        by_rank = sorted(ends, key=self._rank.__getitem__)
        return self.common_ancestor(by_rank[0], by_rank[-1])

    def crossed_bodies(self, group: RowGroup) -> Iterator[tuple[int, int]]:
        """Bodies across whose inboard hinge a group is pending, with a count of ends.

        Yields (body, number of ends on it or outboard of it).
        """
        ancestor = self.closing_body(group.ends)
        counts: dict[int, int] = {}
        for end in group.ends:
            body = end
            while body != ancestor:
                counts[body] = counts.get(body, 0) + 1
                body = self.parent[body]
        yield from counts.items()

    def pending(self, groups: Iterable[RowGroup]) -> list[int]:
        """Number of rows pending across the inboard hinge of each body.

        O(N log N) for any path lengths: ends are counted from the tips inwards, and each pair of
        neighbouring ends is subtracted once at its common ancestor.
        """
        count = [0] * (len(self.parent) + 1)
        for group in groups:
            ends = sorted(group.ends, key=self._rank.__getitem__)
            count[ends[0]] += group.count
            for left_end, right_end in pairwise(ends):
                count[right_end] += group.count
                count[self.common_ancestor(left_end, right_end)] -= group.count
            count[self.common_ancestor(ends[0], ends[-1])] -= group.count
        for body in reversed(self.order):
            count[self.parent[body]] += count[body]
        return count[:GROUND]


def pending_cost(rows: int) -> int:
    """Cost of pending rows at one hinge, up to a constant factor.

    Each pair of rows is combined there.  The column of each row passes the hinge as well, at the
    cost of a few pairs.
    """
    return rows * rows + 3 * rows


def total_cost(mechanism: MechanismGraph, tree: Tree) -> int:
    """Cost of the pending rows of a tree, summed over its hinges."""
    groups = [mechanism.groups[number] for number in mechanism.closures(tree)]
    return sum(map(pending_cost, Paths(mechanism, tree).pending(groups)))
