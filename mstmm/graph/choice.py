"""Which hinges make the tree: the choice that leaves the least work to the loops.

What rows cost while they are pending is a weighted sum over fundamental cycles, whose least value
nobody finds fast in general; single swaps from a good start find it in practice (E. Amaldi,
L. Liberti, F. Maffioli, N. Maculan, Edge-swapping algorithms for the minimum fundamental cycle
basis problem, 2009).
"""

from __future__ import annotations

from itertools import accumulate

from .growing import Tree, at_random, breadth_first, depth_first
from .mechanism import Mechanism
from .paths import work
from .swaps import swapped

_RANDOM_STARTS = 6
#: Work of all the starts that are improved, but for the first: a second or so.
_AFFORDABLE = 20_000_000


def chosen(mechanism: Mechanism) -> Tree:
    """Per body the hinge that holds it, hinges never turned round; the same for the same input.

    Raises ValueError where no tree reaches every body (`obstacles` says why).
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
