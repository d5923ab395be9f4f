"""Structure: what of a scene decides its fused code; everything else is a number read at run time.

A number of the scene that is exactly zero, or exactly +-1 where it is an axis, is part of the
structure: code for it is never generated, and touching it means another structure (and another
library).  Every other number is a place in the parameter vector p.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from .facts import builtin_hinges
from .kernel import KernelIR

#: A structural constant (float) or a place in p (int).
Entry = float | int
Entries = tuple[Entry, ...]
#: (kind, name) of an element; its kernels are looked up by name.
Key = tuple[str, str]


@dataclass(frozen=True)
class ExpressionStructure:
    """Expressions of the scene; their numbers are read from the kernel's input "constants"."""

    kernel: KernelIR
    constants: Entries


@dataclass(frozen=True)
class ModalStructure:
    """Internal coordinates of a flexible body whose floating frame is this body.

    `moments` and `drag` (empty: none) are the inputs of the kernel "momentum" of ("sweep", "modal")
    from p to M, by name; stiffness and damping (n x n) row by row.
    """

    n: int
    q: int
    u: int
    moments: tuple[tuple[str, Entries], ...]
    drag: tuple[tuple[str, Entries], ...]
    stiffness: Entries
    damping: Entries


@dataclass(frozen=True)
class SectionStructure:
    """A section of the flexible body with floating frame `frame`, which a connection passes:
    outward from the frame to an end, or inward from the end that is held.

    `numbers` are the inputs r, phi, theta, g_x .. g_z, h_x .. h_z of the kernel "section", by name.
    """

    frame: int
    inward: bool
    numbers: tuple[tuple[str, Entries], ...]
    end: Entries


@dataclass(frozen=True)
class BodyStructure:
    """One body with its inboard hinge, in the engine's internal frames.

    rotation, position: inboard hinge axes in the parent (9, row by row) and its point Q (3).
    link: instead of both, cosine, sine and shift of a screw about x, then the constant angle and
    shift of the hinge's own screw about z; empty where the connection is none.
    `imposed[k]` marks a driven speed; `rotor` is the reflected inertia per speed.  `pending` are
    the rows of closed loops that are open across the hinge, `bent` those that pass its own modes.
    """

    parent: int
    hinge: Key
    body: Key
    q: int
    u: int
    nq: int
    nu: int
    rotation: Entries
    position: Entries
    hinge_p: Entries
    body_p: Entries
    rotor: Entries
    link: Entries
    imposed: tuple[int, ...]
    modal: ModalStructure | None = None
    section: SectionStructure | None = None
    idle: bool = False  #: an end that nothing hangs on or acts on
    pending: tuple[int, ...] = ()
    bent: tuple[int, ...] = ()


@dataclass(frozen=True)
class LawStructure:
    """Law `kernel` on n speeds of a body's hinge; effort[k] is a place among the values, or -1."""

    body: int
    kernel: str
    coordinate: int
    speed: int
    n: int
    twist: int
    p: Entries
    axes: Entries
    effort: tuple[int, ...]


@dataclass(frozen=True)
class LoadStructure:
    """Force and moment at a point of a body; components are places among the values, or -1."""

    body: int
    axes: int
    axes_own: Entries
    offset: Entries
    force: tuple[int, ...]
    moment: tuple[int, ...]


@dataclass(frozen=True)
class ForceStructure:
    """Massless element between an end F and an end T; body -1 is the ground."""

    element: Key
    body_f: int
    body_t: int
    axes_f: Entries
    axes_t: Entries
    offset_f: Entries
    offset_t: Entries
    p: Entries
    effort: ExpressionStructure | None


@dataclass(frozen=True)
class ClosureStructure:
    """A hinge that closes a loop: body `frame`, without mass, is to be where an end of `outboard`
    is, which lies in that body by `turn` (9, row by row) and `end` (3).  `rows` are those of its
    six directions, own speeds first; -1 where a direction has none, -2 where nothing is asked of
    it.  Constraints ask less: as `kind` says, by the numbers `p`."""

    frame: int
    outboard: int
    turn: Entries
    end: Entries
    rows: tuple[int, ...]
    kind: str = "hinge"
    p: Entries = ()


@dataclass(frozen=True)
class RowStructure:
    """A row that is closed on a body, coupled with `others` that are open yet; a pivot up to
    `floor` is rounding.  `soft` is the rotor inertia of the speed whose row it is; empty: the row
    is met.  One `of_speeds` asks nothing of positions.  `rest` is the place in memory that is
    non-zero while others are met instead; -1: never."""

    body: int
    others: tuple[int, ...]
    floor: Entries
    soft: Entries
    of_speeds: bool = False
    rest: int = -1


#: Numbers of a coupling, in their order; behind them stands -C of each of its hinges.
COUPLING = ("drift", "gap", "slip", "still")


@dataclass(frozen=True)
class CouplingStructure:
    """A coupling of coordinates: its row (-1: others do what it asks), where its numbers begin
    among those of `Structure.coupled`, the value that it keeps, and (body, where -C begins) of
    every hinge that it names."""

    row: int
    first: int
    of_speeds: bool
    kept: Entries
    columns: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Structure:
    """A scene without its numbers.  `values` gives efforts and load components, `drives` each
    drive's value, rate and acceleration (three in a row; `driven` says whose: body, coordinate).
    `closures` stand in the order of their frames, `rows` in that in which they are closed;
    `coupled` gives the numbers of all `couplings`."""

    nq: int
    nu: int
    np: int
    n_memory: int
    gravity: Entries
    bodies: tuple[BodyStructure, ...]
    laws: tuple[LawStructure, ...] = ()
    loads: tuple[LoadStructure, ...] = ()
    forces: tuple[ForceStructure, ...] = ()
    values: ExpressionStructure | None = None
    drives: ExpressionStructure | None = None
    driven: tuple[tuple[int, int], ...] = ()
    closures: tuple[ClosureStructure, ...] = ()
    rows: tuple[RowStructure, ...] = ()
    couplings: tuple[CouplingStructure, ...] = ()
    coupled: ExpressionStructure | None = None
    elements: Mapping[Key, str] = field(default_factory=dict)  #: hashes of users' elements
    #: (place among the numbers of inputs, place in p) of those that are read: they change with time
    inputs: tuple[tuple[int, int], ...] = field(default=(), repr=False, compare=False)
    refines: int = 0  #: how often accelerations of a tree are refined

    @property
    def closes(self) -> bool:
        """Whether anything closes but the tree."""
        return bool(self.closures or self.couplings)

    def identity(self) -> str:
        """SHA-256 over everything that decides the fused code, kernels of mstmm itself aside."""
        return hashlib.sha256(repr(self).encode()).hexdigest()


def angle_of(hinge: Key) -> int | None:
    """The coordinate that turns a built-in hinge about z, of those that move about and along z."""
    facts = builtin_hinges().get(hinge[1])
    return facts.turns[0] if facts is not None and facts.axial and facts.turns else None
