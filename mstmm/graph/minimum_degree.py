"""Minimum-degree ordering: the elimination order of coupled groups of rows, and its fill-in."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Sequence

#: For each group the groups it is coupled with.
Adjacency = list[set[int]]


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
