"""Plan of loop closures: rows pending across each hinge, and the order of their closure.

Rows close at the lowest common ancestor of their ends.  There their matrix has the rank of the
rows, and no hinge inboard of it can change that matrix.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

from .choice import chosen
from .degree import Couplings, eliminated
from .growing import Tree
from .mechanism import GROUND, Mechanism, Rows
from .paths import Paths, work_of


@dataclass(frozen=True, slots=True)
class Closing:
    """Closure of a group of rows at `body` (-1: the ground).

    `coupled` are the groups still open that share a block of L with it, ascending.  Some of them
    close later at this body, the others stay pending.
    """

    group: int
    body: int
    coupled: tuple[int, ...]


@dataclass(frozen=True)
class Plan:
    """Spanning tree of a mechanism and the closures of its loops.

    `groups` are the groups of rows: those of the cut hinges that have any, in hinge order, then
    the other rows of the mechanism in their order.  `cut_of` are the hinges of the former.  `tree`
    gives the inboard hinge of each body, `cut` all other hinges.  `pending` gives for each body the
    groups that pass its inboard hinge, ascending.  `closings` are in the order of the backward
    pass: outboard bodies first.
    """

    mechanism: Mechanism
    tree: Tree
    cut: tuple[int, ...]
    cut_of: tuple[int, ...]
    groups: tuple[Rows, ...]
    pending: tuple[tuple[int, ...], ...]
    closings: tuple[Closing, ...]

    @property
    def rows(self) -> int:
        """Number of constraint rows of all closures."""
        return sum(group.count for group in self.groups)

    @cached_property
    def pending_rows(self) -> tuple[int, ...]:
        """Number of rows pending across the inboard hinge of each body."""
        return tuple(sum(self.groups[g].count for g in groups) for groups in self.pending)

    @property
    def front(self) -> int:
        """Largest number of rows pending across one hinge."""
        return max(self.pending_rows, default=0)

    @property
    def work(self) -> int:
        """Cost that the tree minimises: sum of m^2 + 3 m over all hinges with m pending rows."""
        return sum(map(work_of, self.pending_rows))

    def loop(self, cut: int) -> tuple[int, ...]:
        """Hinges of the loop that a cut hinge closes, in order around the loop, itself first."""
        hinges = self.mechanism.hinges
        ways: list[list[int]] = []
        for body in (hinges[cut].outboard, hinges[cut].inboard):
            ways.append([])
            while body != GROUND:
                ways[-1].append(self.tree[body])
                body = hinges[self.tree[body]].inboard
        outboard, inboard = ways
        while outboard and inboard and outboard[-1] == inboard[-1]:
            outboard.pop()
            inboard.pop()
        return (cut, *outboard, *reversed(inboard))

    @cached_property
    def blocks(self) -> tuple[tuple[int, int], ...]:
        """Pairs of groups with a nonzero block of L, diagonal pairs included, in closing order."""
        return tuple(
            (closing.group, other)
            for closing in self.closings
            for other in (closing.group, *closing.coupled)
        )


def planned(mechanism: Mechanism) -> Plan:
    """Choose the tree of least cost and plan its loop closures.

    Raises ValueError where no tree reaches every body.
    """
    return closed_along(mechanism, chosen(mechanism))


def closed_along(mechanism: Mechanism, tree: Tree) -> Plan:
    """Plan the loop closures of a given tree."""
    cut = mechanism.cuts(tree)
    cut_of = tuple(hinge for hinge in cut if mechanism.hinges[hinge].rows)
    groups = (*(mechanism.groups[hinge] for hinge in cut_of), *mechanism.others)
    paths = Paths(mechanism, tree)
    pending: list[list[int]] = [[] for _ in range(mechanism.bodies)]
    closing: dict[int, list[int]] = {}
    for number, group in enumerate(groups):
        for body, _ in paths.crossed(group):
            pending[body].append(number)
        closing.setdefault(paths.closes_at(group.ends), []).append(number)
    closings = tuple(_closings(paths, groups, pending, closing))
    return Plan(mechanism, tree, cut, cut_of, groups, tuple(map(tuple, pending)), closings)


def _closings(
    paths: Paths, groups: tuple[Rows, ...], pending: list[list[int]], closing: dict[int, list[int]]
) -> Iterator[Closing]:
    """Closures in elimination order; groups whose rows pass the same hinge are coupled."""
    couplings: Couplings = [set() for _ in groups]
    rows = [group.count for group in groups]
    for body in (*reversed(paths.order), GROUND):
        if body in closing:
            for group, coupled in eliminated(closing[body], couplings, rows):
                yield Closing(group, body, coupled)
        if body != GROUND:
            for one, other in combinations(pending[body], 2):
                couplings[one].add(other)
                couplings[other].add(one)
