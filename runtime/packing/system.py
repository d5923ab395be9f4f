"""System: the numbers of a scene in internal frames, as all engines take them.

Nothing in here knows of C.  Numbers are floats, or Duals that carry their derivatives.  Of a chain
the members that are alike share one record.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, Integers
from mstmm.ir import KernelIR
from mstmm.ir.kernel import reads_port
from mstmm.ir.scene_structure import Key
from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial

from .coordinate_layout import Group

Numbers = tuple[float, ...]
#: Force elements whose laws do not go by time.
_BUILT_IN: tuple[Key, ...] = (
    ("force", "spring"), ("force", "bushing6"), ("force", "bearing6"), ("force", "bearing3"),
)  # fmt: skip
#: Places among the values of the scene's expressions, -1 for the constant zero.
Places = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Arrays:
    """Arrays by their names; two are equal where all their numbers are."""

    named: Mapping[str, Array]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Arrays) and list(self.named) == list(other.named) and all(
            np.array_equal(array, other.named[name]) for name, array in self.named.items()
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class ModalNumbers:
    """Internal coordinates of the flexible body whose floating frame a body is.

    `moments` and `drag` are inputs of kernels of ("sweep", "modal"); `stiffness` and `damping` are
    n x n.
    """

    n: int
    q: int
    u: int
    moments: Arrays
    drag: Arrays | None
    matrices: Arrays


@dataclass(frozen=True, slots=True)
class SectionNumbers:
    """A section of the flexible body with its frame at place `frame`, passed inward to the frame or
    outward from it; `inputs` are those of the kernel "section", `end` its axes at rest (9)."""

    frame: int
    inward: bool
    inputs: Arrays
    end: Numbers


@dataclass(frozen=True, slots=True)
class BodyNumbers:
    """A body with its inboard hinge, but for its place in the tree.

    `straight` says that the rates of the hinge's coordinates are its speeds, `steady` that its
    motions are the same in every position, seen from the outboard body, `turning` that they are
    turns alone besides.
    `connection` is Rt (9) and ro (3), `link` the same as screws about x and z where it can be one
    (`alignment`), else empty.  `height` is that of the frame over the hinge's own P, along z.
    `body_frame` is the frame in the user's (rotation, origin), empty for a rigid body.  `rotor` and
    `imposed` go by speed, `release` is a place in memory or -1.  `idle` is an end that nothing
    hangs on or acts on.  `linked` says that it may be swept as a link.
    """

    hinge: Key
    body: Key
    nq: int
    nu: int
    straight: bool
    steady: bool
    turning: bool
    connection: Numbers
    link: Numbers
    height: float
    hinge_p: Numbers
    body_p: Numbers
    body_frame: Numbers
    rotor: Numbers
    imposed: tuple[int, ...]
    release: int
    modal: ModalNumbers | None
    section: SectionNumbers | None
    idle: bool
    linked: bool = True


@dataclass(frozen=True, slots=True)
class BodyRun:
    """`count` bodies in a row from `place` on, each the child of the one before: a body of its own,
    or a chain.

    `alike` are the first member, one `period` of those that repeat behind it, and the last.
    `slots` are the hinges' places in q and u.
    """

    place: int
    parent: int
    count: int
    period: int
    alike: tuple[BodyNumbers, ...]
    slots: Group

    @property
    def which(self) -> Integers:
        """Member by member its number among `alike`."""
        found = 1 + np.arange(-1, self.count - 1) % self.period
        found[0], found[-1] = 0, len(self.alike) - 1
        return found

    def member(self, k: int) -> BodyNumbers:
        """Numbers of member k."""
        if k in (0, self.count - 1):
            return self.alike[-1 if k else 0]
        return self.alike[1 + (k - 1) % self.period]


@dataclass(frozen=True, slots=True)
class LawNumbers:
    """The law `kernel` on n speeds of a hinge, that of `member` in the pattern of its run.

    `turn` is its number among the pattern's laws that remember a turn, or -1; `axes` (9) are
    theirs.  `efforts` go by speed: one for all repeats of the pattern, or one for each.
    """

    member: int
    kernel: str
    coordinate: int
    speed: int
    n: int
    turn: int
    p: Numbers
    axes: Numbers
    efforts: tuple[Places, ...]


@dataclass(frozen=True, slots=True)
class LawRun:
    """`count` laws on the bodies from `place` on: those of a pattern of `period` bodies, repeated;
    `twist` is the first of their places in memory."""

    place: int
    count: int
    period: int
    pattern: tuple[LawNumbers, ...]
    twist: int

    @property
    def turns(self) -> int:
        """Laws of the pattern that remember a turn."""
        return sum(law.turn >= 0 for law in self.pattern)

    @property
    def next_twist(self) -> int:
        """Place in memory behind the last of the run."""
        repeats, rest = divmod(self.count, len(self.pattern))
        return self.twist + repeats * self.turns + sum(x.turn >= 0 for x in self.pattern[:rest])

    def each(self) -> Iterator[tuple[LawNumbers, int, int, Places]]:
        """(law, place of its body, place in memory or -1, efforts) one by one."""
        turns = self.turns
        for row in range(self.count):
            repeat, which = divmod(row, len(self.pattern))
            law = self.pattern[which]
            twist = self.twist + repeat * turns + law.turn if law.turn >= 0 else -1
            body = self.place + repeat * self.period + law.member
            yield law, body, twist, law.efforts[repeat if len(law.efforts) > 1 else 0]


@dataclass(frozen=True, slots=True)
class LoadNumbers:
    """Force and moment at a point of a body; components in axes of the body `axes` (-1: inertial),
    which lie in its internal ones as `axes_own` says."""

    body: int
    axes: int
    axes_own: Numbers
    offset: Numbers
    force: Places
    moment: Places


@dataclass(frozen=True, slots=True)
class ForceNumbers:
    """Massless element between (body, axes (9), offset (3)) of an end F and of an end T; body -1 is
    the ground.  `effort`: t, q, u, [length, its rate] -> given effort."""

    element: Key
    ends: tuple[tuple[int, Numbers, Numbers], tuple[int, Numbers, Numbers]]
    p: Numbers
    effort: KernelIR | None


@dataclass(frozen=True, slots=True)
class HeldInputs:
    """Inputs that stand in memory, where they are set as a run goes on: `places` of all inputs
    there, -1 for those that go by time; memory begins from `first` on with `start`."""

    first: int
    places: tuple[int, ...]
    start: Numbers = ()


#: Directions of a closure, each with a place in memory where rows are chosen.
DIRECTIONS = 6


@dataclass(frozen=True, slots=True)
class ClosureNumbers:
    """What closes a loop: a hinge, behind which the body without mass at place `frame` is to be
    where an end of the body at place `outboard` (-1: the ground) is, its axes turned by `turn` (9)
    and its origin at `end` (3) in that body's.  `directions` are those of the rows: 0 to 5, the
    hinge's speeds first.

    Constraints ask less of the two: as `kind` says, one of those in derive/equations/constraints.py
    with its numbers `p`, or "hinge".  `of_speeds` are the directions in which nothing is asked of
    positions.  Of the six directions the first `asked` say something; those without a row repeat
    what others do.  Where some of the rows repeat the others but which do changes along the way,
    `choice` tells the first place in memory of whether each is at rest, and how many count.
    """

    frame: int
    outboard: int
    turn: Numbers
    end: Numbers
    directions: tuple[int, ...]
    kind: str = "hinge"
    p: Numbers = ()
    of_speeds: tuple[int, ...] = ()
    asked: int = 6
    choice: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class CoupledHinge:
    """A hinge that a coupling names: `place` of the body, or frame, whose inboard hinge it is, and
    places of the bodies on both sides (-1: the ground)."""

    place: int
    inboard: int
    outboard: int


@dataclass(frozen=True, slots=True)
class CouplingNumbers:
    """A row between coordinates of hinges, or `of_speeds`; its numbers are those of `coupled` from
    `first` on.  `kept` is the value that it keeps, None while that is not known; `repeats` says
    that other rows do what it asks, so that it has none."""

    name: str
    first: int
    hinges: tuple[CoupledHinge, ...]
    of_speeds: bool
    kept: float | None
    repeats: bool = False


@dataclass(frozen=True)
class System:
    """A scene in internal frames.

    `values` gives efforts and load components of (t, q, u); `drives` value, rate and acceleration
    of each of `driven` (place of the body, coordinate).  `inputs` are inputs and signals over time,
    whose numbers expressions read, of which some may be `held`; `by_time` says whether an
    effort or load names the time, or an input that does not stand still.  `moving` are the numbers
    in expressions that carry derivatives, by their places in the port "moving".  `closures` are
    what closes loops; `coupled` gives the numbers of the `couplings` (pack/loops/couplings).
    `strained` is the place in memory that tells whether the last step ended near a singular pose,
    -1 where nothing can close.
    """

    nq: int
    nu: int
    n_memory: int
    strained: int
    gravity: Numbers
    bodies: tuple[BodyRun, ...]
    laws: tuple[LawRun, ...]
    loads: tuple[LoadNumbers, ...]
    forces: tuple[ForceNumbers, ...]
    values: KernelIR | None
    drives: KernelIR | None
    driven: tuple[tuple[int, int], ...]
    inputs: tuple[PiecewisePolynomial, ...]
    held: HeldInputs
    by_time: bool
    moving: Mapping[int, Any]
    closures: tuple[ClosureNumbers, ...] = ()
    couplings: tuple[CouplingNumbers, ...] = ()
    coupled: KernelIR | None = None

    @property
    def remembers(self) -> bool:
        """Whether a state alone does not say how it goes on."""
        return self.n_memory > (self.strained >= 0)

    @property
    def chosen(self) -> range:
        """Places in memory that tell which rows of closed loops are at rest."""
        firsts = [one.choice[0] for one in self.closures if one.choice is not None]
        return range(firsts[0], firsts[-1] + DIRECTIONS) if firsts else range(0)

    @property
    def closes(self) -> bool:
        """Whether anything closes but the tree."""
        return bool(self.closures or self.couplings)

    def awake(self, place: int) -> System:
        """The same where the body at a place of the tree is none that is idle."""
        found = tuple(
            replace(run, alike=(replace(run.alike[0], idle=False),))
            if run.place == place and run.count == 1 else run
            for run in self.bodies
        )  # fmt: skip
        return replace(self, bodies=found)

    @property
    def count(self) -> int:
        """How many bodies there are."""
        return self.bodies[-1].place + self.bodies[-1].count if self.bodies else 0

    @property
    def dragged(self) -> list[int]:
        """Places of the flexible bodies on which the medium drags."""
        dragged = self.rows(lambda one: one.modal is not None and one.modal.drag is not None)
        return [int(place) for place in np.flatnonzero(dragged)]

    @property
    def steady(self) -> bool:
        """Whether nothing goes by time: neither drive nor expression nor what a coupling equals,
        nor an element that may."""
        own = any(force.element not in _BUILT_IN for force in self.forces)
        coupled = self.coupled is not None and reads_port(self.coupled, "t")
        return not (self.driven or self.timed or own or coupled)

    @property
    def timed(self) -> bool:
        """Whether an expression of an effort or load goes by time."""
        kernels = [self.values, *(force.effort for force in self.forces)]
        reading = any(kernel is not None and reads_port(kernel, "t") for kernel in kernels)
        return reading and self.by_time

    def inputs_at(self, t: float) -> Array:
        """The numbers of all inputs at a time, as expressions read them."""
        return np.array([x for one in self.inputs for x in one.at(t)])

    @property
    def n_values(self) -> int:
        """How many values the expressions give."""
        return 0 if self.values is None else self.values.outputs[0].length()

    @cached_property
    def _starts(self) -> list[int]:
        return [run.place for run in self.bodies]

    def body(self, place: int) -> BodyNumbers:
        """Numbers of the body at a place of the tree."""
        run = self.bodies[bisect_right(self._starts, place) - 1]
        return run.member(place - run.place)

    @property
    def distinct(self) -> Iterator[BodyNumbers]:
        """Every body that differs from others."""
        for run in self.bodies:
            yield from run.alike

    @property
    def parents(self) -> Integers:
        """Place of every body's parent, -1 for the ground."""
        found = np.arange(-1, self.count - 1)
        for run in self.bodies:
            found[run.place] = run.parent
        return found

    @property
    def places(self) -> dict[str, Integers]:
        """Every body's first coordinate "q" and first speed "u"."""
        q, u = np.zeros((2, self.count), dtype=np.int64)
        for run in self.bodies:
            members, one, slots = slice(run.place, run.place + run.count), run.count == 1, run.slots
            q[members] = slots.q if one else slots.q_places()
            u[members] = slots.u if one else slots.u_places()
        return {"q": q, "u": u}

    @property
    def which(self) -> Integers:
        """Body by body its number among the `distinct` ones."""
        found, first = np.zeros(self.count, dtype=np.int64), 0
        for run in self.bodies:
            if run.count == 1:
                found[run.place] = first
            else:
                found[run.place : run.place + run.count] = first + run.which
            first += len(run.alike)
        return found

    def rows(self, number: Callable[[BodyNumbers], Any]) -> NDArray[Any]:
        """A number of every body, or a row of as many of each."""
        return np.array([number(one) for one in self.distinct])[self.which]
