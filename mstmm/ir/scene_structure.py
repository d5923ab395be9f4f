"""Structure of a scene: the part that determines its fused code; the rest is run-time data.

A number of the scene that is exactly zero, or exactly +-1 in an axis, is part of the structure: no
code is generated for it, and changing it requires another structure (and another library).  Every
other number is an index into the parameter vector p.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from .hinge_properties import builtin_hinges
from .kernel import KernelIR

#: A structural constant (float) or an index into p (int).
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
    """Modal coordinates of a flexible body whose floating frame is this body.

    `moments` and `drag` (empty: none) are inputs of the kernel "momentum" of ("sweep", "modal"),
    from p to M, by name.  Stiffness and damping (n x n) are row-major.
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
    """Section of the flexible body with floating frame `frame` at an end of a connection.

    The connection leads outward from the frame to an end, or inward from the end at the inboard
    hinge.  `numbers` are the inputs r, phi, theta, g_x .. g_z, h_x .. h_z of the kernel "section",
    by name; for a segment between stations of an exact beam b and Bm of "segment".
    """

    frame: int
    inward: bool
    numbers: tuple[tuple[str, Entries], ...]
    end: Entries

    @property
    def is_segment(self) -> bool:
        """Whether it leads from one station of an exact beam to the next, or to an end."""
        return any(name == "Bm" for name, _ in self.numbers)


@dataclass(frozen=True)
class BodyStructure:
    """Body with its inboard hinge, in the internal frames of the engine.

    rotation, position: inboard hinge axes in the parent (9, row-major) and its point Q (3).
    link: replaces both by cosine, sine and shift of a screw about x, then the constant angle and
    shift of the hinge's screw about z; empty where the connection has no such form.
    `imposed[k]` marks a speed of prescribed motion; `rotor` is the reflected inertia per speed.
    `pending` are the constraint rows of loops that pass the hinge and are not eliminated yet,
    `bent` those that involve the modes of the body.
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
    idle: bool = False  #: an end without hinges and loads
    pending: tuple[int, ...] = ()
    bent: tuple[int, ...] = ()


@dataclass(frozen=True)
class LawStructure:
    """Hinge law `kernel` on n speeds of a body's hinge; effort[k] indexes the values, or is -1."""

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
    """Force and moment at a point of a body; components are indices of the values, or -1."""

    body: int
    axes: int
    axes_own: Entries
    offset: Entries
    force: tuple[int, ...]
    moment: tuple[int, ...]


@dataclass(frozen=True)
class ForceStructure:
    """Massless force element between an end F and an end T; body -1 is the ground."""

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
    """Cut hinge of a loop, or constraint between two bodies.

    The massless body `frame` has to coincide with an end of `outboard`, which `turn` (9, row-major)
    and `end` (3) locate in that body.  `rows` are the constraint rows of its six directions, those
    of the hinge's speeds first; -1 where a direction has no row, -2 where it is unconstrained.
    Other constraints restrict fewer directions, according to `kind` and the numbers `p`.
    """

    frame: int
    outboard: int
    turn: Entries
    end: Entries
    rows: tuple[int, ...]
    kind: str = "hinge"
    p: Entries = ()


@dataclass(frozen=True)
class RowStructure:
    """Constraint row that is eliminated on a body, coupled with `others` eliminated later.

    A pivot up to `floor` is rounding.  `soft` is the rotor inertia of the speed that the row
    belongs to; empty: the row is satisfied exactly.  A row `of_speeds` does not constrain
    positions.  `rest` is the index into the memory that is non-zero while other rows are active
    instead; -1: never.
    """

    body: int
    others: tuple[int, ...]
    floor: Entries
    soft: Entries
    of_speeds: bool = False
    rest: int = -1


#: Numbers of a coupling, in this order; -C of each of its hinges follows.
COUPLING_NUMBERS = ("drift", "gap", "slip", "time_rate")


@dataclass(frozen=True)
class CouplingStructure:
    """Coupling of coordinates, a constraint between coordinates of hinges.

    It has its row (-1: redundant), the index of its first number among those of
    `Structure.coupled`, the value that it keeps constant, and (body, first index of -C) of every
    hinge that it names.
    """

    row: int
    first: int
    of_speeds: bool
    kept: Entries
    columns: tuple[tuple[int, int], ...]


@dataclass(frozen=True)
class Structure:
    """Scene without its numerical values.

    `values` gives efforts and load components, `drives` each prescribed motion's value, rate and
    acceleration (three in a row; `driven` has the body and coordinate of each).  `closures` are in
    the order of their frames, `rows` in the order of their elimination; `coupled` gives the numbers
    of all `couplings`.
    """

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
    #: (index among the numbers of inputs, index in p) of the inputs in use: they change with time
    inputs: tuple[tuple[int, int], ...] = field(default=(), repr=False, compare=False)
    refines: int = 0  #: how often accelerations of a tree are refined

    @property
    def closes(self) -> bool:
        """Whether the scene has loops, constraints or couplings besides the tree."""
        return bool(self.closures or self.couplings)

    def identity(self) -> str:
        """SHA-256 of everything that determines the fused code, except the kernels of mstmm."""
        return hashlib.sha256(repr(self).encode()).hexdigest()


def rotation_coordinate(hinge: Key) -> int | None:
    """Coordinate that rotates a built-in hinge about z, if it moves only about and along z."""
    facts = builtin_hinges().get(hinge[1])
    return facts.turns[0] if facts is not None and facts.axial and facts.turns else None
