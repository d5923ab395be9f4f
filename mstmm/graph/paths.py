"""Ways inside a tree: parents before children, and where branches meet."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property
from itertools import pairwise

from .growing import Tree
from .mechanism import GROUND, Mechanism, Rows


class Paths:
    """Parents, orders and common ancestors of a tree.

    `parent` per body, -1 for the ground; `order` are the bodies, each branch in one piece, parents
    first.
    """

    def __init__(self, mechanism: Mechanism, tree: Tree) -> None:
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
        """Place of every body in `order`; last: the ground, before all."""
        rank = [GROUND] * (len(self.parent) + 1)
        for place, body in enumerate(self.order):
            rank[body] = place
        return rank

    @cached_property
    def _heads(self) -> list[int]:
        """Per body the first of its line; every body goes on the line of its heaviest child, so
        that a way to the ground changes lines a logarithm of times at most."""
        size = [1] * (len(self.parent) + 1)
        for body in reversed(self.order):
            size[self.parent[body]] += size[body]
        heavy = [GROUND] * (len(self.parent) + 1)
        for body in self.order:
            parent = self.parent[body]
            if heavy[parent] == GROUND or size[body] > size[heavy[parent]]:
                heavy[parent] = body
        heads = list(range(len(self.parent)))
        for body in self.order:
            parent = self.parent[body]
            if parent != GROUND and heavy[parent] == body:
                heads[body] = heads[parent]
        return heads

    def meet(self, one: int, other: int) -> int:
        """The lowest common ancestor of two bodies, a body itself among its ancestors."""
        rank, heads = self._rank, self._heads
        while one != GROUND and other != GROUND and heads[one] != heads[other]:
            if rank[heads[one]] > rank[heads[other]]:
                one = self.parent[heads[one]]
            else:
                other = self.parent[heads[other]]
        return one if rank[one] < rank[other] else other

    def closes_at(self, ends: Iterable[int]) -> int:
        """Where the ways inwards from all ends have met."""
        by_rank = sorted(ends, key=self._rank.__getitem__)
        return self.meet(by_rank[0], by_rank[-1])

    def crossed(self, group: Rows) -> Iterator[tuple[int, int]]:
        """(body, how many of the ends are on it or farther out) for every body across whose hinge
        the rows of a group are pending."""
        last = self.closes_at(group.ends)
        counts: dict[int, int] = {}
        for end in group.ends:
            body = end
            while body != last:
                counts[body] = counts.get(body, 0) + 1
                body = self.parent[body]
        yield from counts.items()

    def pending(self, groups: Iterable[Rows]) -> list[int]:
        """Per body how many rows are pending across the hinge that holds it.

        O(N log N), however long the ways are: ends are counted from the tips inwards, each pair of
        neighbouring ends once less where they meet.
        """
        count = [0] * (len(self.parent) + 1)
        for group in groups:
            ends = sorted(group.ends, key=self._rank.__getitem__)
            count[ends[0]] += group.count
            for one, other in pairwise(ends):
                count[other] += group.count
                count[self.meet(one, other)] -= group.count
            count[self.meet(ends[0], ends[-1])] -= group.count
        for body in reversed(self.order):
            count[self.parent[body]] += count[body]
        return count[:GROUND]


def work_of(rows: int) -> int:
    """What `rows` pending rows cost at a hinge, up to a factor: each pair of them meets there, and
    the column of each passes it, which is as much as a few pairs."""
    return rows * rows + 3 * rows


def work(mechanism: Mechanism, tree: Tree) -> int:
    """What the pending rows of a tree cost, all its hinges together."""
    groups = [mechanism.groups[number] for number in mechanism.closures(tree)]
    return sum(map(work_of, Paths(mechanism, tree).pending(groups)))
