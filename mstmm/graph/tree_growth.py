"""Spanning trees grown from the ground along the hinges, each from inboard to outboard."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable

from .mechanism_graph import GROUND, MechanismGraph

#: A tree: for each body its inboard hinge.
Tree = tuple[int, ...]
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
