"""What a pass is made of: calls of kernels over named slots, and the little that moves numbers.

A step is done where its condition `when` holds: traits separated by spaces, all of which must hold;
"!" before a trait asks for its absence.  Traits and slots are explained in `words`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

#: Orders in which a pass meets what it is for.
ROOT_TO_TIPS, TIPS_TO_ROOT = "root to tips", "tips to root"
#: Fields of what moves numbers that name slots.
_NAMED = ("to", "source", "free", "imposed")


@dataclass(frozen=True)
class Step:
    """Anything a pass does."""

    when: str = ""

    @property
    def traits(self) -> tuple[tuple[str, bool], ...]:
        """(trait, whether it must hold) of the condition."""
        return tuple((word.lstrip("!"), not word.startswith("!")) for word in self.when.split())


@dataclass(frozen=True)
class Call(Step):
    """A kernel over slots.

    `kernel` is "element.kernel"; "generic{nu}" and "generic{free}" stand for the steps for any
    hinge with so many speeds, "hinge", "body", "law", "force" and "link" for the element that is
    there.  `ports` are (port, slot); outputs that nobody wants are left out.  A guard that does not
    hold ends the sweep with the reason `fails`; without one no guard can fail.
    """

    kernel: str = ""
    ports: tuple[tuple[str, str], ...] = ()
    fails: str = ""


@dataclass(frozen=True)
class Copy(Step):
    """to = source; an empty source means zeros."""

    to: str = ""
    source: str = ""


@dataclass(frozen=True)
class Add(Step):
    """to += times * source."""

    to: str = ""
    source: str = ""
    times: int = 1


@dataclass(frozen=True)
class SelectColumns(Step):
    """to = the columns of `source` (rows x nu) that belong to free speeds; rows = 0: of a row for
    each speed those of free speeds, too."""

    to: str = ""
    source: str = ""
    rows: int = 1


@dataclass(frozen=True)
class ScatterSpeeds(Step):
    """to[k] = free[...] for the free speeds, imposed[k] for the others."""

    to: str = ""
    free: str = ""
    imposed: str = ""


@dataclass(frozen=True)
class Gather(Step):
    """to = those of the scene's expression values that `places` names; none is zero."""

    to: str = ""
    places: str = ""


@dataclass(frozen=True)
class Evaluate(Step):
    """to = value of an expression of the scene, which may read `given` (port, slot)."""

    to: str = ""
    expression: str = ""
    given: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class EachSpeed(Step):
    """Steps for every speed k of a hinge, or for every imposed one; "[k]" marks its entry."""

    steps: tuple[Step, ...] = ()
    imposed: bool = False


@dataclass(frozen=True)
class Move(Step):
    """count numbers of `source` to `to`; "[width * c]" is the row of a direction
    (`ForEachDirection`)."""

    to: str = ""
    source: str = ""
    count: str = ""


@dataclass(frozen=True)
class ForEachDirection(Step):
    """Steps for every direction of a body, or of the body that a law is about; the derivatives that
    they read have been pointed along it: direction number c of

    `of`: "free", the unknowns of a hinge; "felt", those that a law feels; "rates", its speeds
    alone; "coordinates", its coordinates alone; "modes", the unknowns of a flexible body; "motion",
    the nine numbers of a motion, "spin" the first three; "place", the nine of a change of place,
    "turn" the first three; "law", the unknowns that go with the speeds that a law acts on.
    """

    of: str = ""
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True)
class ForEach(Step):
    """Steps for each of

    `of`: "closings", the rows that close on a body, where the passes done are those of rows, and
    "openings", the same the other way round; "pending", the rows whose columns go across its hinge;
    "before", those of them up to the one at hand; "bent", the rows that ends of a flexible body
    bring, "bent_before" likewise; "rows", the rows of a hinge that closes a loop,
    each in direction number c; "own", the rows of couplings of such a hinge; "others", the rows
    that a row is coupled with when it closes;
    "seconds", those of them up to the one at hand.
    """

    of: str = ""
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True)
class ByScrew(Step):
    """Steps chosen by what is known of a rotation and a position when code is made for a scene.

    `about_x`, `about_z`: a screw about that axis.  `turning`: a rotation of which nothing is known.
    `otherwise`: what is left, whose zeros fold.
    """

    rotation: str = ""
    position: str = ""
    about_x: tuple[Step, ...] = ()
    about_z: tuple[Step, ...] = ()
    turning: tuple[Step, ...] = ()
    otherwise: tuple[Step, ...] = ()


@dataclass(frozen=True)
class ChooseBias(Step):
    """Along every free unit direction of H the bias motion is stopped by the speed's own
    acceleration (`chosen`): deviations from it are recovered whatever it is, and zeros fold."""

    subspace: str = ""
    motion: str = ""
    chosen: str = ""


@dataclass(frozen=True)
class CheckPivots(Step):
    """Every diagonal entry of D against the mean inertia of the body itself, where the kernel that
    eliminates asks for no more than a positive one."""

    pivots: str = ""
    subspace: str = ""
    own: str = ""
    whole: str = ""
    fails: str = ""


@dataclass(frozen=True)
class Pass:
    """What is done with every body (law, load, ...) in turn.

    `subject` names what is met, `order` how; `skip` is the condition under which one is passed by.
    `given` are slots that the caller hands over instead of reading them where they usually lie;
    where `spares_links` holds, bodies that are swept as links have no part in it.  A `flat` one is
    of a scene in a plane, and of the little that the looped engine keeps of its bodies.
    """

    name: str
    subject: str
    purpose: str
    steps: tuple[Step, ...]
    order: str = ROOT_TO_TIPS
    skip: str = ""
    given: tuple[str, ...] = ()
    spares_links: str = ""
    flat: bool = False


@dataclass(frozen=True)
class RunPass(Step):
    """All steps of another pass, for the same body."""

    whole: Pass | None = None


@dataclass(frozen=True)
class Run(Step):
    """A pass over all its subjects, or (`hook`) a piece of the looped engine's own."""

    whole: Pass | None = None
    hook: str = ""


@dataclass(frozen=True)
class Sweep:
    """Passes one after the other, and what comes out of them."""

    name: str
    purpose: str
    runs: tuple[Run, ...]


def call(kernel: str, when: str = "", fails: str = "", **ports: str) -> Call:
    """A call by the names of its ports."""
    return Call(when, kernel, tuple(ports.items()), fails)


def only(when: str, *steps: Step) -> tuple[Step, ...]:
    """Steps under one more condition."""
    return tuple(replace(step, when=f"{when} {step.when}".strip()) for step in steps)


def inner(step: Step) -> Iterator[Step]:
    """The step and every step inside it."""
    yield step
    parts: tuple[Step, ...] = ()
    if isinstance(step, (EachSpeed, ForEachDirection, ForEach)):
        parts = step.steps
    elif isinstance(step, ByScrew):
        parts = (*step.about_x, *step.about_z, *step.turning, *step.otherwise)
    elif isinstance(step, RunPass) and step.whole is not None:
        parts = step.whole.steps
    for part in parts:
        yield from inner(part)


def elsewhere(whole: Pass, name: str, slots: Mapping[str, str]) -> Pass:
    """The same steps over other slots; `name` goes before the pass's own."""

    def renamed(step: Step) -> Step:
        if isinstance(step, RunPass):
            assert step.whole is not None
            return replace(step, whole=elsewhere(step.whole, name, slots))
        if isinstance(step, Call):
            ports = ((port, slots.get(slot, slot)) for port, slot in step.ports)
            return replace(step, ports=tuple(ports))
        found = {key: slots.get(slot, slot) for key, slot in vars(step).items() if key in _NAMED}
        return replace(step, **found)

    return replace(whole, name=f"{name}_{whole.name}", steps=tuple(map(renamed, whole.steps)))
