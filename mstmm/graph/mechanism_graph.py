"""Mechanism as a graph: bodies, hinges between them, and constraint rows of each closure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

GROUND = -1


@dataclass(frozen=True, slots=True)
class Edge:
    """Hinge as an edge from the body `inboard` (or the ground) to the body `outboard`.

    `rows` is its number of constraint rows if it is cut: 6 less its coordinates, plus one for each
    coordinate that is driven or carries rotor inertia.  `cut` True: it closes a loop; False: it is
    part of the tree; None: whichever costs less.
    """

    inboard: int
    outboard: int
    rows: int
    cut: bool | None = None


@dataclass(frozen=True, slots=True)
class RowGroup:
    """Group of constraint rows between the bodies `ends`, two or more.

    The ends of a coupling of hinges are the bodies on both sides of each hinge, cut or not: the
    row of a coordinate starts at its hinge.
    """

    ends: tuple[int, ...]
    count: int


@dataclass(frozen=True)
class MechanismGraph:
    """Bodies 0 to `bodies` - 1, the hinges between them, and the rows of other closures.

    A spanning tree has one inboard hinge for every body; the other hinges are cut.
    """

    bodies: int
    hinges: tuple[Edge, ...]
    constraint_groups: tuple[RowGroup, ...] = ()

    @cached_property
    def holders(self) -> tuple[tuple[int, ...], ...]:
        """For each body the candidates for its inboard hinge in a tree, in scene order."""
        optional_hinges: list[list[int]] = [[] for _ in range(self.bodies)]
        required_hinges: list[list[int]] = [[] for _ in range(self.bodies)]
        for hinge, edge in enumerate(self.hinges):
            if edge.cut is None:
                optional_hinges[edge.outboard].append(hinge)
            elif not edge.cut:
                required_hinges[edge.outboard].append(hinge)
        return tuple(
            tuple(required or optional)
            for required, optional in zip(required_hinges, optional_hinges, strict=True)
        )

    @cached_property
    def groups(self) -> tuple[RowGroup, ...]:
        """Row groups: those of every hinge if it were cut, then the other rows."""
        closures = (RowGroup((edge.inboard, edge.outboard), edge.rows) for edge in self.hinges)
        return (*closures, *self.constraint_groups)

    def cuts(self, tree: tuple[int, ...]) -> tuple[int, ...]:
        """Cut hinges: those that are not part of a tree."""
        tree_hinges = set(tree)
        return tuple(hinge for hinge in range(len(self.hinges)) if hinge not in tree_hinges)

    def closures(self, tree: tuple[int, ...]) -> tuple[int, ...]:
        """Indices of the groups that close with a tree: its cut hinges, then the other rows."""
        first_other = len(self.hinges)
        return (*self.cuts(tree), *range(first_other, first_other + len(self.constraint_groups)))
