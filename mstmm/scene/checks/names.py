"""What a name in an expression refers to."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...expression.expression import Name
from ..rules.messages import near
from ..rules.written import constants

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.hinge import Hinge
    from ..tables.members import Bodies, Hinges


#: Names of the modal coordinates of a flexible body; None where they are not known before it is
#: compiled.
Modal = tuple[str, ...] | None


def flexible(scene: SceneTables) -> dict[str, Modal]:
    """The modal coordinates of every flexible body by its name."""
    beams: dict[str, Modal] = {beam.name: beam.mode_names for beam in scene.beam}
    return beams | {elastic.name: None for elastic in scene.elastic}


#: Of a point on a curve: where along it, and how fast.
ALONG = ("s", "s_rate")
POSITIONS = ("x", "y", "z", "vx", "vy", "vz")


@dataclass(frozen=True)
class Scope:
    """Names an expression may use.

    `own` is the hinge whose `q`, `u` and parameters need no prefix, `spring` means that `q` and
    `u` are a length and its rate, `positions` allows x, y, z, vx, vy, vz of bodies and ends.
    `flexible` are the flexible bodies by name, whose q and u are the modal coordinates; `inputs`
    are the names of inputs and signals, `curves` of constraints to a curve.
    """

    hinges: Hinges
    bodies: Bodies
    own: Hinge | None = None
    spring: bool = False
    positions: bool = False
    flexible: Mapping[str, Modal] = field(default_factory=dict)
    inputs: Collection[str] = ()
    curves: Collection[str] = ()


def problem_with(name: Name, scope: Scope) -> str | None:
    """Why the name means nothing in this scope; None where it means something."""
    if len(name.parts) == 1:
        return _bare(name, scope)
    if name.owner in scope.curves:
        return _along(name)
    if name.owner in scope.flexible and name.quantity not in POSITIONS:
        return _modal(name, scope.flexible[name.owner])
    if name.quantity in ("q", "u") and (len(name.parts) == 2 or name.is_member):
        hinge = scope.hinges.find(name.hinge)
        if hinge is None:
            return scope.hinges.missing(name.hinge, repr(name.hinge))
        return _indexed(name, scope.hinges[hinge], name.hinge)
    if name.quantity in POSITIONS:
        return _position(name, scope)
    if scope.hinges.find(name.hinge) is not None:
        return f"{name.text!r} is unknown; of a hinge there is {name.hinge}.q and {name.hinge}.u"
    if scope.positions and scope.bodies.find(name.owner) is not None:
        return f"{name.text!r} is unknown; of a body or end there is x, y, z, vx, vy, vz"
    return f"{name.text!r} is unknown; write the name of a hinge and .q or .u"


def _bare(name: Name, scope: Scope) -> str | None:
    word = name.parts[0]
    parameters: Collection[str] = scope.own.parameters if scope.own is not None else ()
    if word == "t" or word in parameters or word in scope.inputs:
        return None if name.index is None else f"{word!r} is one number; leave out [{name.index}]"
    if word in ("q", "u"):
        if scope.own is not None:
            return _indexed(name, scope.own, scope.own.name)
        if scope.spring:
            return None if name.index in (None, 0) else f"{name.text!r}: a spring has one length"
        return f"{name.text!r} needs the name of a hinge here, as in shoulder.{word}"
    own = ["q", "u"] if scope.own is not None or scope.spring else []
    there = ["t", *own, "pi", *parameters, *scope.inputs, *constants()]
    return f"{word!r} is unknown{near(word, there)}"


def _modal(name: Name, modes: Modal) -> str | None:
    """A modal coordinate or its rate: blade.q[0], blade.u[0]."""
    if len(name.parts) == 2 and name.quantity in ("q", "u"):
        if modes is None:
            if name.index is not None:
                return None
            return f"{name.text!r}: say which shape, as in {name.text}[0]"
        return index_problem(name, name.owner, len(modes), "flexible body")
    if len(name.parts) == 2 and name.quantity in (modes or ()):
        place = (modes or ()).index(name.quantity)
        return f"{name.text!r} is unknown; write {name.owner}.q[{place}]"
    return (
        f"{name.text!r} is unknown; of a flexible body there is {name.owner}.q[0], "
        f"{name.owner}.u[0], and in events x, y, z, vx, vy, vz of it and its ends"
    )


def _along(name: Name) -> str | None:
    """A point's way along a curve: wire.s, wire.s_rate."""
    if len(name.parts) == 2 and name.quantity in ALONG and name.index is None:
        return None
    own = " and ".join(f"{name.owner}.{one}" for one in ALONG)
    return f"{name.text!r} is unknown; of a point on a curve there is {own}"


def _indexed(name: Name, hinge: Hinge, called: str) -> str | None:
    """Does the hinge have this coordinate?  User types are checked with their definition."""
    kind = hinge.builtin
    if kind is None:
        return None
    entries = kind.coordinates if name.quantity == "q" else kind.speeds
    return index_problem(name, called, len(entries))


def index_problem(name: Name, hinge: str, count: int, word: str = "hinge") -> str | None:
    """Message if a hinge with `count` coordinates has no entry of this index."""
    if count == 0:
        return f'{name.text!r}: {word} "{hinge}" is fixed and has no coordinates'
    if name.index is None and count > 1:
        return (
            f'{name.text!r}: {word} "{hinge}" has {count} entries; '
            f"write {name.text}[0] to {name.text}[{count - 1}]"
        )
    if name.index is not None and name.index >= count:
        return f'{name.text!r}: the last entry of {word} "{hinge}" is [{count - 1}]'
    return None


def _position(name: Name, scope: Scope) -> str | None:
    if not scope.positions:
        return (
            f"{name.text!r}: positions and velocities of bodies are known to events and release "
            "only; use the q and u of hinges"
        )
    if name.index is not None:
        return f"{name.text!r} is one number; leave out [{name.index}]"
    ends = scope.bodies.ends(name.owner)
    if ends is None:
        return scope.bodies.missing(name.owner, repr(name.owner))
    end = ".".join(name.parts[1:-1])
    if end and end not in ends:
        return f'body "{name.owner}" has no end {end!r}{near(end, ends)}'
    return None
