"""Minimum-degree ordering: the elimination order of coupled groups of rows, and its fill-in."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Sequence

#: For each group the groups it is coupled with.
Couplings = list[set[int]]


def eliminated(
    groups: Iterable[int], couplings: Couplings, rows: Sequence[int]
) -> list[tuple[int, tuple[int, ...]]]:
    """Order groups by minimum degree: (group, groups coupled with it when it is eliminated).

    The degree of a group is the number of rows coupled with it; ties go to the lower group number.
    Eliminating a group couples all groups that were coupled with it.  `couplings` is updated in
    place, also for the groups that are not eliminated.
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
