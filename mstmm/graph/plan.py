"""Where loops close: which rows are pending across which hinge, and in which order they close.

Rows close at the lowest common ancestor of their ends, where their matrix has the rank of the rows
and no hinge farther in can change it.
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
    """A group of rows closes at `body` (-1: the ground).

    `coupled` are the groups still open then that share a block of L with it, ascending: some close
    at this body later, the others stay pending.
    """

    group: int
    body: int
    coupled: tuple[int, ...]


@dataclass(frozen=True)
class Plan:
    """The tree of a mechanism and the closing of its loops.

    Groups of rows are numbered as `groups`: those of the cut hinges that have any, in the order of
    the hinges, then the other rows of the mechanism in their order; `cut_of` are the hinges of the
    first.  `tree` is per body the hinge that holds it, `cut` are all other hinges.  `pending` is
    per body the groups that pass the hinge that holds it, ascending.  `closings` come in the order
    in which a sweep to the ground can do them: farther bodies first.
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
        """Rows of all closures."""
        return sum(group.count for group in self.groups)

    @cached_property
    def pending_rows(self) -> tuple[int, ...]:
        """Per body how many rows are pending across the hinge that holds it."""
        return tuple(sum(self.groups[g].count for g in groups) for groups in self.pending)

    @property
    def front(self) -> int:
        """Rows pending across one hinge at most."""
        return max(self.pending_rows, default=0)

    @property
    def work(self) -> int:
        """The sum of m^2 + 3 m over all hinges with m pending rows, which the tree makes least."""
        return sum(map(work_of, self.pending_rows))

    def loop(self, cut: int) -> tuple[int, ...]:
        """The hinges around the loop that a cut hinge closes, in the order in which they follow
        each other, itself first."""
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
        """Pairs of groups whose block of L is not zero, (group, group) among them, each pair in
        the order in which its groups close."""
        return tuple(
            (closing.group, other)
            for closing in self.closings
            for other in (closing.group, *closing.coupled)
        )


def planned(mechanism: Mechanism) -> Plan:
    """The tree with the least work and how its loops close.

    Raises ValueError where no tree reaches every body.
    """
    return closed_along(mechanism, chosen(mechanism))


def closed_along(mechanism: Mechanism, tree: Tree) -> Plan:
    """How loops close along a given tree."""
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
    """Groups are coupled where their rows pass the same hinge."""
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
