"""System: the numbers of a scene in internal frames, the common input of all engines.

It is independent of C.  Numbers are floats, or Duals with derivatives.  Equal members of a chain
share one record.  "Position" means the position of a body in the tree; the ground is -1.
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
#: Force elements whose laws do not depend on time.
_TIME_INDEPENDENT: tuple[Key, ...] = (
    ("force", "spring"), ("force", "bushing6"), ("force", "bearing6"), ("force", "bearing3"),
)  # fmt: skip
#: Indices of values of the scene's expressions, -1 for constant zero.
Indices = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Arrays:
    """Named arrays; equal if all their entries are equal."""

    named: Mapping[str, Array]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Arrays) and list(self.named) == list(other.named) and all(
            np.array_equal(array, other.named[name]) for name, array in self.named.items()
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class ModalNumbers:
    """Modal coordinates of a flexible body, stored with its floating frame.

    Attributes:
        n: number of modes.
        q, u: index of the first one in q and in u.
        moments, drag: inputs of the kernels ("sweep", "modal").
        matrices: "stiffness" and "damping" (n, n).
    """

    n: int
    q: int
    u: int
    moments: Arrays
    drag: Arrays | None
    matrices: Arrays


@dataclass(frozen=True, slots=True)
class SectionNumbers:
    """Section of a flexible body in a connection.

    Attributes:
        frame: position of the floating frame.
        inward: whether the connection leads to the frame, or from it.
        inputs: of the kernel "section", or of "segment" between stations of an exact beam.
        end: axes of the section in the undeformed body (9).
    """

    frame: int
    inward: bool
    inputs: Arrays
    end: Numbers

    @property
    def is_segment(self) -> bool:
        """Whether it leads from one station of an exact beam to the next, or to an end."""
        return "Bm" in self.inputs.named


@dataclass(frozen=True, slots=True)
class BodyNumbers:
    """Body with its inboard hinge, without its position.

    Attributes:
        straight, steady, turning: see `HingeSlots`.
        connection: Rt (9) and ro (3).
        link: the same as screws about x and z (`internal_frames`); empty if impossible.
        height: shift along z of the internal frame from the hinge's outboard frame, m.
        hinge_p, body_p: parameters of the kernels.
        body_frame: internal frame in user axes: rotation (9), origin (3); empty for a rigid body.
        rotor: inertia by speed.
        imposed: 1 for each prescribed speed.
        release: index in memory, -1 if the hinge is never released.
        idle: whether it is an end without hinges, loads and force elements.
        linked: whether it may be swept as a link.
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
    """Bodies at consecutive positions, each the child of the previous: a single body or a chain.

    Attributes:
        position: position of the first one.
        parent: position of its parent.
        count: number of bodies.
        period: number of bodies after which the pattern repeats.
        members: the first member, one period of the following ones, and the last.
        slots: indices of the hinges in q and u.
    """

    position: int
    parent: int
    count: int
    period: int
    members: tuple[BodyNumbers, ...]
    slots: Group

    @property
    def member_indices(self) -> Integers:
        """Index in `members` of each member (count,)."""
        indices = 1 + np.arange(-1, self.count - 1) % self.period
        indices[0], indices[-1] = 0, len(self.members) - 1
        return indices

    def member(self, k: int) -> BodyNumbers:
        """Numbers of member k."""
        if k in (0, self.count - 1):
            return self.members[-1 if k else 0]
        return self.members[1 + (k - 1) % self.period]


@dataclass(frozen=True, slots=True)
class LawNumbers:
    """Law on n speeds of a hinge.

    Attributes:
        member: number of the hinge in the pattern of its run.
        kernel: name of the law kernel.
        coordinate, speed: first ones within the hinge.
        turn: number among the pattern's laws that track a rotation angle in memory, or -1.
        axes: of such a law (9).
        efforts: expression values by speed: once for all repeats of the pattern, or for each.
    """

    member: int
    kernel: str
    coordinate: int
    speed: int
    n: int
    turn: int
    p: Numbers
    axes: Numbers
    efforts: tuple[Indices, ...]


@dataclass(frozen=True, slots=True)
class LawRun:
    """Laws of a run of bodies: those of a pattern, repeated.

    Attributes:
        position: position of the first body.
        count: number of laws.
        period: number of bodies of the pattern.
        pattern: its laws.
        twist: index in memory of the first tracked rotation angle.
    """

    position: int
    count: int
    period: int
    pattern: tuple[LawNumbers, ...]
    twist: int

    @property
    def rotation_count(self) -> int:
        """Number of laws of the pattern that track a rotation angle."""
        return sum(law.turn >= 0 for law in self.pattern)

    @property
    def next_angle_index(self) -> int:
        """Index in memory after the last tracked angle of the run."""
        repeats, rest = divmod(self.count, len(self.pattern))
        return (
            self.twist
            + repeats * self.rotation_count
            + sum(x.turn >= 0 for x in self.pattern[:rest])
        )

    def iterate_laws(self) -> Iterator[tuple[LawNumbers, int, int, Indices]]:
        """All laws: (law, position of its body, index in memory or -1, efforts)."""
        turns = self.rotation_count
        for row in range(self.count):
            repeat, k = divmod(row, len(self.pattern))
            law = self.pattern[k]
            twist = self.twist + repeat * turns + law.turn if law.turn >= 0 else -1
            body = self.position + repeat * self.period + law.member
            yield law, body, twist, law.efforts[repeat if len(law.efforts) > 1 else 0]


@dataclass(frozen=True, slots=True)
class LoadNumbers:
    """Force and moment at a point of a body.

    Attributes:
        body, axes: positions of the loaded body and of the body whose axes the components are in
            (-1: inertial axes).
        axes_own: axes of the components in the internal ones of `axes` (9).
        offset: point in internal axes, m.
        force, moment: expression values of the components.
    """

    body: int
    axes: int
    axes_own: Numbers
    offset: Numbers
    force: Indices
    moment: Indices


@dataclass(frozen=True, slots=True)
class ForceNumbers:
    """Massless force element between two ends.

    Attributes:
        ends: (position of the body, axes (9), offset (3) in m) of the ends "from" and "to".
        p: parameters of the kernel.
        effort: kernel (t, q, u, [length, its rate]) -> prescribed effort; None without one.
    """

    element: Key
    ends: tuple[tuple[int, Numbers, Numbers], tuple[int, Numbers, Numbers]]
    p: Numbers
    effort: KernelIR | None


@dataclass(frozen=True, slots=True)
class HeldInputs:
    """Inputs that controllers set during a run, in memory.

    Attributes:
        first: index in memory of the first number.
        memory_indices: index in memory of each input, -1 for functions of time.
        start: initial numbers from `first` on.
    """

    first: int
    memory_indices: tuple[int, ...]
    start: Numbers = ()


#: Number of directions of a closure, and of its entries in memory if its rows are chosen.
DIRECTIONS = 6


@dataclass(frozen=True, slots=True)
class ClosureNumbers:
    """Closure of a loop: a massless frame must coincide with an end of a body.

    Attributes:
        frame, outboard: positions of the massless frame and of the body.
        turn, end: axes (9) and origin (3, m) of that end in the internal axes of the body.
        directions: directions that have a constraint row, of 0 to 5, the hinge's speeds first.
        kind: "hinge", or a constraint of derive/equations/constraints.py, which constrains less.
        p: numbers of the constraint.
        speed_directions: directions that are constrained at the level of speeds only.
        asked: number of constrained directions; those of them without a row are redundant.
        choice: (first index in memory, number of active rows) if the redundant rows change during
            the motion; memory holds whether each row is inactive.
    """

    frame: int
    outboard: int
    turn: Numbers
    end: Numbers
    directions: tuple[int, ...]
    kind: str = "hinge"
    p: Numbers = ()
    speed_directions: tuple[int, ...] = ()
    asked: int = 6
    choice: tuple[int, int] | None = None


@dataclass(frozen=True, slots=True)
class CoupledHinge:
    """Hinge of a coupling: positions of its outboard body or frame, and of the coupled bodies."""

    position: int
    inboard: int
    outboard: int


@dataclass(frozen=True, slots=True)
class CouplingNumbers:
    """Constraint between coordinates or speeds of hinges.

    Attributes:
        first: index of its numbers in the output of `System.coupled`.
        of_speeds: whether it is on speeds.
        constant: constant value of its expression, None while it is unknown.
        repeats: whether it is redundant and has no row.
    """

    name: str
    first: int
    hinges: tuple[CoupledHinge, ...]
    of_speeds: bool
    constant: float | None
    repeats: bool = False


@dataclass(frozen=True)
class System:
    """Scene in internal frames.

    Attributes:
        n_memory: length of the memory of a run.
        strain_index: index in memory of whether the last step ended near a singular configuration,
            -1 without loops.
        values: kernel of efforts and load components.
        drives: kernel of value, rate and acceleration of each driven coordinate.
        driven: (position of the body, coordinate) of each driven coordinate.
        inputs: inputs and signals over time.
        held_inputs: those that are set during a run.
        depends_on_time: whether an effort or load depends on time, also by an input.
        seeded_numbers: numbers in expressions that carry derivatives, by index in the port
            "moving".
        coupling_kernel: kernel of the numbers of `couplings` (`closures`).
    """

    nq: int
    nu: int
    n_memory: int
    strain_index: int
    gravity: Numbers
    bodies: tuple[BodyRun, ...]
    laws: tuple[LawRun, ...]
    loads: tuple[LoadNumbers, ...]
    forces: tuple[ForceNumbers, ...]
    values: KernelIR | None
    drives: KernelIR | None
    driven: tuple[tuple[int, int], ...]
    inputs: tuple[PiecewisePolynomial, ...]
    held_inputs: HeldInputs
    depends_on_time: bool
    seeded_numbers: Mapping[int, Any]
    closures: tuple[ClosureNumbers, ...] = ()
    couplings: tuple[CouplingNumbers, ...] = ()
    coupling_kernel: KernelIR | None = None

    @property
    def uses_memory(self) -> bool:
        """Whether the motion depends on memory in addition to the state."""
        return self.n_memory > (self.strain_index >= 0)

    @property
    def inactive_row_indices(self) -> range:
        """Indices in memory of the inactive constraint rows."""
        firsts = [closure.choice[0] for closure in self.closures if closure.choice is not None]
        return range(firsts[0], firsts[-1] + DIRECTIONS) if firsts else range(0)

    @property
    def has_loops(self) -> bool:
        """Whether there are closed loops."""
        return bool(self.closures or self.couplings)

    def with_active_body(self, place: int) -> System:
        """System in which the body at a position is not idle."""
        bodies = tuple(
            replace(run, members=(replace(run.members[0], idle=False),))
            if run.position == place and run.count == 1 else run
            for run in self.bodies
        )  # fmt: skip
        return replace(self, bodies=bodies)

    @property
    def count(self) -> int:
        """Number of bodies."""
        return self.bodies[-1].position + self.bodies[-1].count if self.bodies else 0

    @property
    def bodies_with_drag(self) -> list[int]:
        """Positions of the flexible bodies with viscous drag."""
        has_drag = self.rows(lambda body: body.modal is not None and body.modal.drag is not None)
        return [int(place) for place in np.flatnonzero(has_drag)]

    @property
    def is_autonomous(self) -> bool:
        """Whether nothing depends on time: drives, expressions, couplings and force elements."""
        unknown_elements = any(force.element not in _TIME_INDEPENDENT for force in self.forces)
        timed_coupling = self.coupling_kernel is not None and reads_port(self.coupling_kernel, "t")
        return not (self.driven or self.has_timed_loads or unknown_elements or timed_coupling)

    @property
    def has_timed_loads(self) -> bool:
        """Whether an expression of an effort or load depends on time."""
        kernels = [self.values, *(force.effort for force in self.forces)]
        reads_time = any(kernel is not None and reads_port(kernel, "t") for kernel in kernels)
        return reads_time and self.depends_on_time

    def inputs_at(self, t: float) -> Array:
        """Numbers of all inputs at a time (s), as expressions read them."""
        return np.array([x for channel in self.inputs for x in channel.piece_at(t)])

    @property
    def n_values(self) -> int:
        """Number of expression values."""
        return 0 if self.values is None else self.values.outputs[0].length()

    @cached_property
    def _run_positions(self) -> list[int]:
        return [run.position for run in self.bodies]

    def body(self, place: int) -> BodyNumbers:
        """Numbers of the body at a position."""
        run = self.bodies[bisect_right(self._run_positions, place) - 1]
        return run.member(place - run.position)

    @property
    def distinct(self) -> Iterator[BodyNumbers]:
        """Distinct bodies; equal members of a chain appear once."""
        for run in self.bodies:
            yield from run.members

    @property
    def parents(self) -> Integers:
        """Position of every body's parent (count,), -1 for the ground."""
        parents = np.arange(-1, self.count - 1)
        for run in self.bodies:
            parents[run.position] = run.parent
        return parents

    @property
    def first_indices(self) -> dict[str, Integers]:
        """Index of every body's first coordinate "q" and first speed "u" (count,)."""
        q, u = np.zeros((2, self.count), dtype=np.int64)
        for run in self.bodies:
            members, slots = slice(run.position, run.position + run.count), run.slots
            is_single = run.count == 1
            q[members] = slots.q if is_single else slots.q_starts()
            u[members] = slots.u if is_single else slots.u_starts()
        return {"q": q, "u": u}

    @property
    def distinct_indices(self) -> Integers:
        """Index of every body in `distinct` (count,)."""
        indices, first = np.zeros(self.count, dtype=np.int64), 0
        for run in self.bodies:
            if run.count == 1:
                indices[run.position] = first
            else:
                indices[run.position : run.position + run.count] = first + run.member_indices
            first += len(run.members)
        return indices

    def rows(self, number: Callable[[BodyNumbers], Any]) -> NDArray[Any]:
        """Array (count, ...) of a number, or a fixed number of them, of every body."""
        return np.array([number(body) for body in self.distinct])[self.distinct_indices]
