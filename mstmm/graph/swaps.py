"""Local search over spanning trees: bodies change their inboard hinge to lower the cost.

A swap at body b changes the pending rows only at b and on the path between its old and its new
inboard body.  This is the path along which the rows of the new hinge are pending before the swap.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from .growing import Tree
from .mechanism import GROUND, Mechanism
from .paths import Paths, work_of


def swapped(mechanism: Mechanism, tree: Tree) -> Tree:
    """Improve a tree by single swaps until none lowers its cost."""
    search = _Search(mechanism, tree)
    search.run()
    return tuple(search.tree)


class _Search:
    """Tree under change, with the groups pending at its hinges.

    `across[body]` maps each group pending across the inboard hinge of the body to the number of its
    ends on the body or outboard of it.  `rows[body]` is the number of rows of these groups.
    """

    def __init__(self, mechanism: Mechanism, tree: Tree) -> None:
        self.hinges, self.groups = mechanism.hinges, mechanism.groups
        self.holders, self.tree = mechanism.holders, list(tree)
        paths = Paths(mechanism, tree)
        self.parent = paths.parent
        self.across: list[dict[int, int]] = [{} for _ in self.parent]
        self.rows = [0] * len(self.parent)
        for number in mechanism.closures(tree):
            for body, ends in paths.crossed(self.groups[number]):
                self._put(body, number, ends)

    def run(self) -> None:
        """Swap while the cost falls; bodies whose gain may have changed are queued again."""
        queue = deque(body for body, holders in enumerate(self.holders) if len(holders) > 1)
        waiting = set(queue)
        while queue:
            body = queue.popleft()
            waiting.discard(body)
            best = min(
                ((self._gain(body, hinge), hinge) for hinge in self.holders[body]), default=(0, 0)
            )
            if best[0] >= 0:
                continue
            for other in self._touched(self._swap(body, best[1])):
                if other not in waiting:
                    waiting.add(other)
                    queue.append(other)

    def _touched(self, bodies: list[int]) -> Iterator[int]:
        """Outboard bodies of the cut hinges whose rows pass the hinges of these bodies."""
        for body in bodies:
            for number in self.across[body]:
                if number < len(self.hinges):
                    yield self.hinges[number].outboard

    def _put(self, body: int, group: int, ends: int) -> None:
        """Store how many ends of a group are outboard of a hinge; none or all means not pending."""
        across, total = self.across[body], self.groups[group]
        if 0 < ends < len(total.ends):
            self.rows[body] += 0 if group in across else total.count
            across[group] = ends
        elif across.pop(group, None) is not None:
            self.rows[body] -= total.count

    def _way(self, body: int, group: int) -> list[int]:
        """Bodies from `body` inwards across whose inboard hinges a group is pending."""
        way = []
        while body != GROUND and group in self.across[body]:
            way.append(body)
            body = self.parent[body]
        return way

    def _gain(self, body: int, hinge: int) -> int:
        """Change of the cost if `hinge` becomes the inboard hinge of the body.

        0 where that is impossible: a body cannot be outboard of itself.
        """
        moved = self.across[body]
        if hinge not in moved:
            return 0
        old = self.tree[body]
        through = self.groups[old].count - self.groups[hinge].count
        gain = work_of(self.rows[body] + through) - work_of(self.rows[body])
        others = [(g, n, len(self.groups[g].ends), self.groups[g].count)
                  for g, n in moved.items() if g != hinge]  # fmt: skip
        for at in self._way(self.parent[body], hinge):
            rows, across = self.rows[at] + through, self.across[at]
            for g, n, total, count in others:
                rows += count * ((across.get(g, total) > n) - (g in across))
            gain += work_of(rows) - work_of(self.rows[at])
        for at in self._way(self.hinges[hinge].inboard, hinge):
            rows, across = self.rows[at] + through, self.across[at]
            for g, n, total, count in others:
                rows += count * ((across.get(g, 0) + n < total) - (g in across))
            gain += work_of(rows) - work_of(self.rows[at])
        return gain

    def _swap(self, body: int, hinge: int) -> list[int]:
        """Make `hinge` the inboard hinge of a body; return the bodies at affected hinges."""
        old, before, after = self.tree[body], self.parent[body], self.hinges[hinge].inboard
        left, taken = self._way(before, hinge), self._way(after, hinge)
        moved = [(g, n, len(self.groups[g].ends)) for g, n in self.across[body].items()
                 if g != hinge]  # fmt: skip
        for way, sign in ((left, -1), (taken, 1)):
            for at in way:
                self._put(at, hinge, 0)
                for g, n, total in moved:
                    absent = total if sign < 0 else 0
                    self._put(at, g, self.across[at].get(g, absent) + sign * n)
                self._put(at, old, 1)
        self._put(body, hinge, 0)
        self._put(body, old, 1)
        self.tree[body], self.parent[body] = hinge, after
        return [body, *left, *taken]
