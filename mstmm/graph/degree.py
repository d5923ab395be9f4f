"""The order in which coupled groups of rows are eliminated, and what it couples anew."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Sequence

#: Per group the groups it is coupled with.
Couplings = list[set[int]]


def eliminated(
    groups: Iterable[int], couplings: Couplings, rows: Sequence[int]
) -> list[tuple[int, tuple[int, ...]]]:
    """(group, those it is coupled with when its turn comes) in the order of minimum degree.

    The degree of a group are the rows it is coupled with; of equals the lower number goes first.
    An eliminated group leaves those it was coupled with coupled to each other: `couplings`, of the
    groups that stay as well, is what is left of it afterwards.
    """
    waiting = set(groups)
    heap = [(sum(rows[other] for other in couplings[g]), g) for g in waiting]
    heapq.heapify(heap)
    order = []
    while heap:
        degree, group = heapq.heappop(heap)
        coupled = couplings[group]
        if group not in waiting or degree != sum(rows[other] for other in coupled):
            continue
        waiting.discard(group)
        order.append((group, tuple(sorted(coupled))))
        for other in coupled:
            couplings[other] |= coupled
            couplings[other] -= {group, other}
        for other in coupled & waiting:
            heapq.heappush(heap, (sum(rows[one] for one in couplings[other]), other))
    return order
