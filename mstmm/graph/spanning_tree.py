"""Choice of the spanning tree: the hinges that leave the least cost to the closed loops.

The cost of pending rows is a weighted sum over fundamental cycles.  Its exact minimum is expensive
to compute in general; single swaps from a good start find it in practice (E. Amaldi, L. Liberti,
F. Maffioli, N. Maculan, Edge-swapping algorithms for the minimum fundamental cycle basis problem,
2009).
"""

from __future__ import annotations

from itertools import accumulate

from .edge_swaps import improve_by_swaps
from .mechanism_graph import MechanismGraph
from .tree_growth import Tree, breadth_first_tree, depth_first_tree, random_tree
from .tree_paths import total_cost

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
