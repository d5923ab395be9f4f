"""Choice of the spanning tree: the hinges that leave the least cost to the closed loops.

The cost of pending rows is a weighted sum over fundamental cycles.  Its exact minimum is expensive
to compute in general; single swaps from a good start find it in practice (E. Amaldi, L. Liberti,
F. Maffioli, N. Maculan, Edge-swapping algorithms for the minimum fundamental cycle basis problem,
2009).
"""

from __future__ import annotations

from itertools import accumulate

from .growing import Tree, at_random, breadth_first, depth_first
from .mechanism import Mechanism
from .paths import work
from .swaps import swapped

_RANDOM_STARTS = 6
#: Largest total cost of the starting trees that are improved: about one second.
_AFFORDABLE = 20_000_000


def chosen(mechanism: Mechanism) -> Tree:
    """Choose the spanning tree of least cost: for each body its inboard hinge.

    Hinges keep their direction.  The result is deterministic.  Raises ValueError where no tree
    reaches every body; `obstacles` gives the reason.
    """
    starts = [breadth_first(mechanism)]
    if all(len(holders) == 1 for holders in mechanism.holders):
        return starts[0]
    starts.append(depth_first(mechanism))
    starts += (at_random(mechanism, seed) for seed in range(_RANDOM_STARTS))
    by_work = sorted((work(mechanism, tree), tree) for tree in set(starts))
    sums = accumulate(cost for cost, _ in by_work)
    tried = [tree for (_, tree), total in zip(by_work, sums, strict=True) if total <= _AFFORDABLE]
    improved = (swapped(mechanism, tree) for tree in tried or [by_work[0][1]])
    return min(improved, key=lambda tree: (work(mechanism, tree), tree))
