"""Rooted trees, by which order conditions of Runge-Kutta and Rosenbrock methods are counted."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

#: A rooted tree is the sorted tuple of its branches.
Tree = tuple["Tree", ...]


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """Rooted trees with so many vertices."""
    return tuple(sorted(set(forests(order - 1, order - 1))))


def forests(vertices: int, largest: int) -> Iterator[Tree]:
    """Multisets of trees with so many vertices in all, none larger than `largest`."""
    if vertices == 0:
        yield ()
    for size in range(1, min(vertices, largest) + 1):
        for tree in trees(size):
            for rest in forests(vertices - size, size):
                yield tuple(sorted((tree, *rest)))


@cache
def density(tree: Tree) -> int:
    """gamma(t): the product of the sizes of all subtrees."""
    product = size(tree)
    for branch in tree:
        product *= density(branch)
    return product


@cache
def size(tree: Tree) -> int:
    return 1 + sum(size(branch) for branch in tree)
