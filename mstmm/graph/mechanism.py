"""What the graph knows of a mechanism: who holds whom, and how many rows a closure has."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

GROUND = -1


@dataclass(frozen=True, slots=True)
class Edge:
    """A hinge: the body `inboard` (or the ground) holds the body `outboard`.

    `rows` is how many rows it has where it closes a loop: 6 less its coordinates, and one for
    each coordinate that is driven or carries rotor inertia.  `cut` True: it closes a loop; False:
    it is part of the tree; None: whichever costs less.
    """

    inboard: int
    outboard: int
    rows: int
    cut: bool | None = None


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows of a constraint or a coupling between the bodies `ends`, two or more.

    A coupling of hinges has the bodies of both sides of each hinge for ends, cut or not: the row
    of a coordinate begins at its hinge.
    """

    ends: tuple[int, ...]
    count: int


@dataclass(frozen=True)
class Mechanism:
    """Bodies 0 to `bodies` - 1, the hinges between them, and rows of other closures.

    A tree of it is one hinge for every body, that which holds it; the other hinges are cut.
    """

    bodies: int
    hinges: tuple[Edge, ...]
    others: tuple[Rows, ...] = ()

    @cached_property
    def holders(self) -> tuple[tuple[int, ...], ...]:
        """Per body the hinges one of which holds it in a tree, in their order."""
        free: list[list[int]] = [[] for _ in range(self.bodies)]
        kept: list[list[int]] = [[] for _ in range(self.bodies)]
        for hinge, edge in enumerate(self.hinges):
            if edge.cut is None:
                free[edge.outboard].append(hinge)
            elif not edge.cut:
                kept[edge.outboard].append(hinge)
        return tuple(tuple(k or f) for k, f in zip(kept, free, strict=True))

    @cached_property
    def groups(self) -> tuple[Rows, ...]:
        """The rows of every hinge where it is cut, then the other rows."""
        closures = (Rows((edge.inboard, edge.outboard), edge.rows) for edge in self.hinges)
        return (*closures, *self.others)

    def cuts(self, tree: tuple[int, ...]) -> tuple[int, ...]:
        """The hinges that a tree leaves."""
        held = set(tree)
        return tuple(hinge for hinge in range(len(self.hinges)) if hinge not in held)

    def closures(self, tree: tuple[int, ...]) -> tuple[int, ...]:
        """Numbers of the groups that a tree has to close: its cuts, then the other rows."""
        first = len(self.hinges)
        return (*self.cuts(tree), *range(first, first + len(self.others)))
