"""Spanning trees grown from the ground along the hinges, each from inboard to outboard."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable

from .mechanism import GROUND, Mechanism

#: A tree: for each body its inboard hinge.
Tree = tuple[int, ...]
#: Maps the number of bodies in the tree to the priority of hinges outboard of the last of them.
Rank = Callable[[int], float]


def breadth_first(mechanism: Mechanism) -> Tree:
    """Breadth-first tree: every body has the shortest possible path to the ground."""
    return _grown(mechanism, float)


def depth_first(mechanism: Mechanism) -> Tree:
    """Depth-first tree: each branch is followed to its tip before the next."""
    return _grown(mechanism, lambda held: -held)


def at_random(mechanism: Mechanism, seed: int) -> Tree:
    """Tree grown by hinges drawn at random; equal seeds give equal trees."""
    draw = random.Random(seed)
    return _grown(mechanism, lambda _: draw.random())


def _grown(mechanism: Mechanism, rank: Rank) -> Tree:
    """Grow a complete tree; raise ValueError where none reaches every body."""
    tree = held(mechanism, rank)
    if None in tree:
        raise ValueError("no spanning tree along the hinges reaches every body")
    return tuple(hinge for hinge in tree if hinge is not None)


def held(mechanism: Mechanism, rank: Rank = float) -> list[int | None]:
    """Grow a tree: for each body its inboard hinge, None where the ground does not reach it.

    The next hinge is that of least rank on a body already in the tree; ties go to the hinge that
    comes first in the scene.
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
    """For each body (last: the ground) the hinges that may connect others outboard of it."""
    outward: list[list[int]] = [[] for _ in range(mechanism.bodies + 1)]
    for holders in mechanism.holders:
        for hinge in holders:
            outward[mechanism.hinges[hinge].inboard].append(hinge)
    return outward
