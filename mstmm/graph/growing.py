"""Trees grown from the ground along the hinges as they are written."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable

from .mechanism import GROUND, Mechanism

#: A tree: per body the hinge that holds it.
Tree = tuple[int, ...]
#: From the number of bodies held so far to the rank of what hangs on the last of them.
Rank = Callable[[int], float]


def breadth_first(mechanism: Mechanism) -> Tree:
    """The tree in which every body is as near to the ground as it can be."""
    return _grown(mechanism, float)


def depth_first(mechanism: Mechanism) -> Tree:
    """The tree that follows each branch to its tip before the next."""
    return _grown(mechanism, lambda held: -held)


def at_random(mechanism: Mechanism, seed: int) -> Tree:
    """A tree grown by hinges drawn at random, the same for the same seed."""
    draw = random.Random(seed)
    return _grown(mechanism, lambda _: draw.random())


def _grown(mechanism: Mechanism, rank: Rank) -> Tree:
    """ValueError where no such tree reaches every body."""
    tree = held(mechanism, rank)
    if None in tree:
        raise ValueError("no tree along the hinges as they are written reaches every body")
    return tuple(hinge for hinge in tree if hinge is not None)


def held(mechanism: Mechanism, rank: Rank = float) -> list[int | None]:
    """Per body the hinge that holds it, None where no way from the ground leads to it.

    Of the hinges that hang on bodies already held the one of least rank comes next, of equals the
    first one written.
    """
    outward = _outward(mechanism)
    tree: list[int | None] = [None] * mechanism.bodies
    count = 0
    waiting = [(rank(count), hinge) for hinge in outward[GROUND]]
    heapq.heapify(waiting)
    while waiting:
        hinge = heapq.heappop(waiting)[1]
        body = mechanism.hinges[hinge].outboard
        if tree[body] is None:
            tree[body] = hinge
            count += 1
            for other in outward[body]:
                heapq.heappush(waiting, (rank(count), other))
    return tree


def _outward(mechanism: Mechanism) -> list[list[int]]:
    """Per body (last: the ground) the hinges that may hold others on it."""
    outward: list[list[int]] = [[] for _ in range(mechanism.bodies + 1)]
    for holders in mechanism.holders:
        for hinge in holders:
            outward[mechanism.hinges[hinge].inboard].append(hinge)
    return outward
