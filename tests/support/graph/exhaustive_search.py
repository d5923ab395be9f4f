"""The same questions asked of every tree and every body: slow, and by the definitions alone."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from mstmm.graph.mechanism_graph import GROUND, MechanismGraph

Tree = tuple[int, ...]


def inwards(mechanism: MechanismGraph, tree: Tree, body: int) -> list[int]:
    """A body, the body that holds it and so on to the ground."""
    way = [body]
    while way[-1] != GROUND:
        way.append(mechanism.hinges[tree[way[-1]]].inboard)
        if len(way) > mechanism.bodies + 1:
            return []
    return way


def trees(mechanism: MechanismGraph) -> Iterator[Tree]:
    """Every choice of one hinge for each body by which all hang on the ground."""
    holding = [
        [h for h, edge in enumerate(mechanism.hinges) if edge.outboard == body]
        for body in range(mechanism.bodies)
    ]
    for tree in product(*holding):
        if all(inwards(mechanism, tree, body) for body in range(mechanism.bodies)):
            yield tree


def pending(mechanism: MechanismGraph, tree: Tree) -> list[set[int]]:
    """Per body the groups with some but not all ends among the bodies it holds, itself included."""
    ways = [set(inwards(mechanism, tree, body)) for body in range(mechanism.bodies)]
    groups: list[tuple[int, tuple[int, ...]]]
    groups = [(h, (mechanism.hinges[h].inboard, mechanism.hinges[h].outboard))
              for h in range(len(mechanism.hinges)) if h not in tree]  # fmt: skip
    first = len(mechanism.hinges)
    groups += [(first + k, rows.ends) for k, rows in enumerate(mechanism.constraint_groups)]
    found: list[set[int]] = [set() for _ in range(mechanism.bodies)]
    for group, ends in groups:
        for body in range(mechanism.bodies):
            behind = sum(end != GROUND and body in ways[end] for end in ends)
            if 0 < behind < len(ends):
                found[body].add(group)
    return found


def work(mechanism: MechanismGraph, tree: Tree) -> int:
    """The sum of m^2 + 3 m over the hinges of a tree, m the rows pending there."""
    first = len(mechanism.hinges)
    total = 0
    for groups in pending(mechanism, tree):
        m = sum(
            mechanism.hinges[g].rows if g < first else mechanism.constraint_groups[g - first].count
            for g in groups
        )
        total += m * m + 3 * m
    return total
