"""Steps of passes: kernel calls on named slots, and copies of numbers.

A step is executed if its condition `when` holds: traits separated by spaces, all of which must
hold; "!" negates a trait.  Traits and slots are defined in `slot_definitions`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

#: Orders in which a pass visits its subjects.
ROOT_TO_TIPS, TIPS_TO_ROOT = "root to tips", "tips to root"
#: Fields of copying steps that name slots.
_SLOT_FIELDS = ("to", "source", "free", "imposed")


@dataclass(frozen=True)
class Step:
    """Base class of steps."""

    when: str = ""

    @property
    def traits(self) -> tuple[tuple[str, bool], ...]:
        """(trait, required value) of each part of the condition."""
        return tuple((word.lstrip("!"), not word.startswith("!")) for word in self.when.split())


@dataclass(frozen=True)
class Call(Step):
    """Kernel call on slots.

    `kernel` is "element.kernel"; "generic{nu}" and "generic{free}" stand for the generic steps
    with that number of speeds, "hinge", "body", "law", "force" and "link" for the current
    element.  `ports` are (port, slot); unused outputs are left out.  A failing guard ends the
    sweep with the reason `fails`; without `fails` no guard can fail.
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
    """to = the columns of `source` (rows x nu) of free speeds.

    With rows = 0, `source` has one row per speed, and only rows of free speeds are copied as
    well.
    """

    to: str = ""
    source: str = ""
    rows: int = 1


@dataclass(frozen=True)
class ScatterSpeeds(Step):
    """to[k] = next entry of `free` for free speeds, imposed[k] for the others."""

    to: str = ""
    free: str = ""
    imposed: str = ""


@dataclass(frozen=True)
class Gather(Step):
    """to = the scene's expression values with the indices `places`; zero without an index."""

    to: str = ""
    places: str = ""


@dataclass(frozen=True)
class Evaluate(Step):
    """to = value of an expression of the scene with the inputs `given` (port, slot)."""

    to: str = ""
    expression: str = ""
    given: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class EachSpeed(Step):
    """Steps for every speed k of a hinge, or every prescribed one; "[k]" is its entry."""

    steps: tuple[Step, ...] = ()
    imposed: bool = False


@dataclass(frozen=True)
class Move(Step):
    """Copy `count` numbers of `source` to `to`; "[width * c]" is the row of direction c."""

    to: str = ""
    source: str = ""
    count: str = ""


@dataclass(frozen=True)
class ForEachDirection(Step):
    """Steps for every direction c of a body, or of the body that a law belongs to.

    The derivatives that the steps read are seeded along the direction.  `of`: "free", the
    unknowns of a hinge; "law_inputs", those that affect a law; "rates", only its speeds;
    "coordinates", only its coordinates; "modes", the unknowns of a flexible body; "motion", the
    nine numbers of a motion, "spin" the first three; "place", the nine of a displacement,
    "turn" the first three; "law", the unknowns of the speeds that a law acts on.
    """

    of: str = ""
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True)
class ForEach(Step):
    """Steps for every constraint row of a set.

    `of`: "closings", the rows that close on a body, for passes over rows, and "openings", the
    same in reverse order; "pending", the rows whose columns cross its hinge; "before", those up
    to the current one; "bent", the rows at ends of a flexible body, "bent_before" those up to
    the current one; "rows", the rows of a hinge that closes a loop, each in direction c; "own",
    the rows of couplings of such a hinge; "others", the rows coupled with a closing row;
    "seconds", those up to the current one.
    """

    of: str = ""
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True)
class ByScrew(Step):
    """Steps selected by the structure of a rotation and a position, when a scene is fused.

    `about_x`, `about_z`: a screw about that axis.  `turning`: a general rotation.  `otherwise`:
    the rest, whose zeros fold.
    """

    rotation: str = ""
    position: str = ""
    about_x: tuple[Step, ...] = ()
    about_z: tuple[Step, ...] = ()
    turning: tuple[Step, ...] = ()
    otherwise: tuple[Step, ...] = ()


@dataclass(frozen=True)
class ChooseBias(Step):
    """Cancel the bias motion along free unit directions of H by the speeds' accelerations.

    These accelerations are stored in `offset`; deviations from them are recovered later, and
    zeros fold.
    """

    subspace: str = ""
    motion: str = ""
    offset: str = ""


@dataclass(frozen=True)
class CheckPivots(Step):
    """Compare each diagonal entry of D with the mean inertia of the body.

    The elimination kernel itself only requires a positive pivot.
    """

    pivots: str = ""
    subspace: str = ""
    own: str = ""
    whole: str = ""
    fails: str = ""


@dataclass(frozen=True)
class Pass:
    """Steps executed for every body (law, load, ...).

    `subject` is the kind of item visited, `order` the order; `skip` is the condition under
    which an item is skipped.  `given` are slots passed by the caller instead of read from
    storage; if `spares_links` holds, bodies that are swept as links are skipped.  A `flat` pass
    belongs to planar scenes, with the reduced storage of their bodies.
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
    """Run all steps of another pass for the same body."""

    whole: Pass | None = None


@dataclass(frozen=True)
class Run(Step):
    """Run a pass over all its subjects, or a hook of the looped engine."""

    whole: Pass | None = None
    hook: str = ""


@dataclass(frozen=True)
class Sweep:
    """Sequence of passes, and its purpose."""

    name: str
    purpose: str
    runs: tuple[Run, ...]


def call(kernel: str, when: str = "", fails: str = "", **ports: str) -> Call:
    """Kernel call with slots by port names."""
    return Call(when, kernel, tuple(ports.items()), fails)


def only(when: str, *steps: Step) -> tuple[Step, ...]:
    """Steps with an additional condition."""
    return tuple(replace(step, when=f"{when} {step.when}".strip()) for step in steps)


def all_steps(step: Step) -> Iterator[Step]:
    """The step and all steps inside it."""
    yield step
    parts: tuple[Step, ...] = ()
    if isinstance(step, (EachSpeed, ForEachDirection, ForEach)):
        parts = step.steps
    elif isinstance(step, ByScrew):
        parts = (*step.about_x, *step.about_z, *step.turning, *step.otherwise)
    elif isinstance(step, RunPass) and step.whole is not None:
        parts = step.whole.steps
    for part in parts:
        yield from all_steps(part)


def with_renamed_slots(whole: Pass, name: str, slots: Mapping[str, str]) -> Pass:
    """Pass with the same steps on other slots; `name` is prefixed to its name."""

    def rename_slots(step: Step) -> Step:
        if isinstance(step, RunPass):
            assert step.whole is not None
            return replace(step, whole=with_renamed_slots(step.whole, name, slots))
        if isinstance(step, Call):
            ports = ((port, slots.get(slot, slot)) for port, slot in step.ports)
            return replace(step, ports=tuple(ports))
        fields = {
            key: slots.get(slot, slot) for key, slot in vars(step).items() if key in _SLOT_FIELDS
        }
        return replace(step, **fields)

    return replace(whole, name=f"{name}_{whole.name}", steps=tuple(map(rename_slots, whole.steps)))
