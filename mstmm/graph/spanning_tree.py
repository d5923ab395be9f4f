"""Choice of the spanning tree: the hinges that leave the least cost to the closed loops.

The cost of pending rows is a weighted sum over fundamental cycles.  Its exact minimum is expensive
to compute in general; single swaps from a good start find it in practice (E. Amaldi, L. Liberti,
F. Maffioli, N. Maculan, Edge-swapping algorithms for the minimum fundamental cycle basis problem,
2009).  A swap at body b changes its inboard hinge, and the pending rows only at b and on the path
between its old and its new inboard body.  This is the path along which the rows of the new hinge
are pending before the swap.
"""

from __future__ import annotations

import heapq
import random
from collections import deque
from collections.abc import Callable, Iterator
from itertools import accumulate

from .mechanism_graph import GROUND, MechanismGraph, Paths, Tree, pending_cost, total_cost

# --- trees grown from the ground along the hinges, each from inboard to outboard ------------------


#: Maps the number of bodies in the tree to the priority of hinges outboard of the last of them.
Priority = Callable[[int], float]


def breadth_first_tree(mechanism: MechanismGraph) -> Tree:
    """Breadth-first tree: every body has the shortest possible path to the ground."""
    return _grow_complete_tree(mechanism, float)


def depth_first_tree(mechanism: MechanismGraph) -> Tree:
    """Depth-first tree: each branch is followed to its tip before the next."""
    return _grow_complete_tree(mechanism, lambda held: -held)


def random_tree(mechanism: MechanismGraph, seed: int) -> Tree:
    """Tree grown by hinges drawn at random; equal seeds give equal trees."""
    draw = random.Random(seed)
    return _grow_complete_tree(mechanism, lambda _: draw.random())


def _grow_complete_tree(mechanism: MechanismGraph, rank: Priority) -> Tree:
    """Grow a complete tree; raise ValueError where none reaches every body."""
    tree = grow_tree(mechanism, rank)
    if None in tree:
        raise ValueError("no spanning tree along the hinges reaches every body")
    return tuple(hinge for hinge in tree if hinge is not None)


def grow_tree(mechanism: MechanismGraph, rank: Priority = float) -> list[int | None]:
    """Grow a tree: for each body its inboard hinge, None where the ground does not reach it.

    The next hinge is that of least rank on a body already in the tree; ties go to the hinge that
    comes first in the scene.
    """
    outboard_hinges = _outboard_hinges(mechanism)
    tree: list[int | None] = [None] * mechanism.bodies
    count = 0
    queue = [(rank(count), hinge) for hinge in outboard_hinges[GROUND]]
    heapq.heapify(queue)
    while queue:
        hinge = heapq.heappop(queue)[1]
        body = mechanism.hinges[hinge].outboard
        if tree[body] is None:
            tree[body] = hinge
            count += 1
            for next_hinge in outboard_hinges[body]:
                heapq.heappush(queue, (rank(count), next_hinge))
    return tree


def _outboard_hinges(mechanism: MechanismGraph) -> list[list[int]]:
    """For each body (last: the ground) the hinges that may connect others outboard of it."""
    outboard_hinges: list[list[int]] = [[] for _ in range(mechanism.bodies + 1)]
    for holders in mechanism.holders:
        for hinge in holders:
            outboard_hinges[mechanism.hinges[hinge].inboard].append(hinge)
    return outboard_hinges


# --- choice of the tree ---------------------------------------------------------------------------


_RANDOM_START_COUNT = 6
#: Largest total cost of the starting trees that are improved: about one second.
_MAX_STARTS_COST = 20_000_000


def spanning_tree(mechanism: MechanismGraph) -> Tree:
    """Choose the spanning tree of least cost: for each body its inboard hinge.

    Hinges keep their direction.  The result is deterministic.  Raises ValueError where no tree
    reaches every body; `tree_problems` gives the reason.
    """
    starts = [breadth_first_tree(mechanism)]
    if all(len(holders) == 1 for holders in mechanism.holders):
        return starts[0]
    starts.append(depth_first_tree(mechanism))
    starts += (random_tree(mechanism, seed) for seed in range(_RANDOM_START_COUNT))
    trees_by_cost = sorted((total_cost(mechanism, tree), tree) for tree in set(starts))
    cost_sums = accumulate(cost for cost, _ in trees_by_cost)
    selected_trees = [
        tree
        for (_, tree), cost_sum in zip(trees_by_cost, cost_sums, strict=True)
        if cost_sum <= _MAX_STARTS_COST
    ]
    improved_trees = (
        improve_by_swaps(mechanism, tree) for tree in selected_trees or [trees_by_cost[0][1]]
    )
    return min(improved_trees, key=lambda tree: (total_cost(mechanism, tree), tree))


# --- local search by swaps ------------------------------------------------------------------------


def improve_by_swaps(mechanism: MechanismGraph, tree: Tree) -> Tree:
    """Improve a tree by single swaps until none lowers its cost."""
    search = _Search(mechanism, tree)
    search.run()
    return tuple(search.tree)


class _Search:
    """Tree under change, with the groups pending at its hinges.

    `across[body]` maps each group pending across the inboard hinge of the body to the number of its
    ends on the body or outboard of it.  `rows[body]` is the number of rows of these groups.
    """

    def __init__(self, mechanism: MechanismGraph, tree: Tree) -> None:
        self.hinges, self.groups = mechanism.hinges, mechanism.groups
        self.holders, self.tree = mechanism.holders, list(tree)
        paths = Paths(mechanism, tree)
        self.parent = paths.parent
        self.pending_end_counts: list[dict[int, int]] = [{} for _ in self.parent]
        self.rows = [0] * len(self.parent)
        for number in mechanism.closures(tree):
            for body, ends in paths.crossed_bodies(self.groups[number]):
                self._store_end_count(body, number, ends)

    def run(self) -> None:
        """Swap while the cost falls; bodies whose gain may have changed are queued again."""
        queue = deque(body for body, holders in enumerate(self.holders) if len(holders) > 1)
        queued = set(queue)
        while queue:
            body = queue.popleft()
            queued.discard(body)
            best = min(
                ((self._cost_change(body, hinge), hinge) for hinge in self.holders[body]),
                default=(0, 0),
            )
            if best[0] >= 0:
                continue
            for affected_body in self._affected_bodies(self._swap(body, best[1])):
                if affected_body not in queued:
                    queued.add(affected_body)
                    queue.append(affected_body)

    def _affected_bodies(self, bodies: list[int]) -> Iterator[int]:
        """Outboard bodies of the cut hinges whose rows pass the hinges of these bodies."""
        for body in bodies:
            for number in self.pending_end_counts[body]:
                if number < len(self.hinges):
                    yield self.hinges[number].outboard

    def _store_end_count(self, body: int, group: int, ends: int) -> None:
        """Store how many ends of a group are outboard of a hinge; none or all means not pending."""
        body_end_counts, row_group = self.pending_end_counts[body], self.groups[group]
        if 0 < ends < len(row_group.ends):
            self.rows[body] += 0 if group in body_end_counts else row_group.count
            body_end_counts[group] = ends
        elif body_end_counts.pop(group, None) is not None:
            self.rows[body] -= row_group.count

    def _pending_path(self, body: int, group: int) -> list[int]:
        """Bodies from `body` inwards across whose inboard hinges a group is pending."""
        path = []
        while body != GROUND and group in self.pending_end_counts[body]:
            path.append(body)
            body = self.parent[body]
        return path

    def _cost_change(self, body: int, hinge: int) -> int:
        """Change of the cost if `hinge` becomes the inboard hinge of the body.

        0 where that is impossible: a body cannot be outboard of itself.
        """
        body_end_counts = self.pending_end_counts[body]
        if hinge not in body_end_counts:
            return 0
        old_hinge = self.tree[body]
        row_difference = self.groups[old_hinge].count - self.groups[hinge].count
        change = pending_cost(self.rows[body] + row_difference) - pending_cost(self.rows[body])
        moved_groups = [(g, n, len(self.groups[g].ends), self.groups[g].count)
                  for g, n in body_end_counts.items() if g != hinge]  # fmt: skip
        for path_body in self._pending_path(self.parent[body], hinge):
            rows, path_end_counts = (
                self.rows[path_body] + row_difference,
                self.pending_end_counts[path_body],
            )
            for g, n, end_total, count in moved_groups:
                rows += count * ((path_end_counts.get(g, end_total) > n) - (g in path_end_counts))
            change += pending_cost(rows) - pending_cost(self.rows[path_body])
        for path_body in self._pending_path(self.hinges[hinge].inboard, hinge):
            rows, path_end_counts = (
                self.rows[path_body] + row_difference,
                self.pending_end_counts[path_body],
            )
            for g, n, end_total, count in moved_groups:
                rows += count * (
                    (path_end_counts.get(g, 0) + n < end_total) - (g in path_end_counts)
                )
            change += pending_cost(rows) - pending_cost(self.rows[path_body])
        return change

    def _swap(self, body: int, hinge: int) -> list[int]:
        """Make `hinge` the inboard hinge of a body; return the bodies at affected hinges."""
        old_hinge, old_parent, new_parent = (
            self.tree[body],
            self.parent[body],
            self.hinges[hinge].inboard,
        )
        old_path, new_path = (
            self._pending_path(old_parent, hinge), self._pending_path(new_parent, hinge),
        )  # fmt: skip
        moved_groups = [
            (g, n, len(self.groups[g].ends))
            for g, n in self.pending_end_counts[body].items()
            if g != hinge
        ]
        for path, sign in ((old_path, -1), (new_path, 1)):
            for path_body in path:
                self._store_end_count(path_body, hinge, 0)
                for g, n, end_total in moved_groups:
                    absent_count = end_total if sign < 0 else 0
                    self._store_end_count(
                        path_body,
                        g,
                        self.pending_end_counts[path_body].get(g, absent_count) + sign * n,
                    )
                self._store_end_count(path_body, old_hinge, 1)
        self._store_end_count(body, hinge, 0)
        self._store_end_count(body, old_hinge, 1)
        self.tree[body], self.parent[body] = hinge, new_parent
        return [body, *old_path, *new_path]
