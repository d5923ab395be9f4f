"""Checks of names in expressions against the elements of a scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...expression.expression import Name
from ..validators.constant_expressions import current_constants
from ..validators.validation_messages import did_you_mean

if TYPE_CHECKING:
    from ..tables.chain import Bodies, Hinges
    from ..tables.hinge import Hinge
    from ..tables.scene_tables import SceneTables


#: Names of the modal coordinates of a flexible body; None where only compilation determines them.
ModalNames = tuple[str, ...] | None


def modal_names(scene: SceneTables) -> dict[str, ModalNames]:
    """Names of the modal coordinates of every flexible body, by its name."""
    beams: dict[str, ModalNames] = {beam.name: beam.mode_names for beam in scene.beam}
    return beams | {elastic.name: None for elastic in scene.elastic}


#: Quantities of a point on a curve: curve parameter and its rate.
CURVE_QUANTITIES = ("s", "s_rate")
POINT_QUANTITIES = ("x", "y", "z", "vx", "vy", "vz")


@dataclass(frozen=True)
class Scope:
    """Names that an expression may use.

    `own` is the hinge whose `q`, `u` and parameters need no prefix.  With `spring`, `q` and `u` are
    a length and its rate.  `positions` allows x, y, z, vx, vy, vz of bodies and ends.  `flexible`
    are the flexible bodies by name, whose q and u are the modal coordinates.  `inputs` are the
    names of inputs and signals, `curves` those of point-on-curve constraints.
    """

    hinges: Hinges
    bodies: Bodies
    own: Hinge | None = None
    spring: bool = False
    positions: bool = False
    flexible: Mapping[str, ModalNames] = field(default_factory=dict)
    inputs: Collection[str] = ()
    curves: Collection[str] = ()


def name_problem(name: Name, scope: Scope) -> str | None:
    """Message about a name that is undefined in this scope; None for defined names."""
    if len(name.parts) == 1:
        return _bare_name_problem(name, scope)
    if name.owner in scope.curves:
        return _curve_name_problem(name)
    if name.owner in scope.flexible and name.quantity not in POINT_QUANTITIES:
        return _modal_name_problem(name, scope.flexible[name.owner])
    if name.quantity in ("q", "u") and (len(name.parts) == 2 or name.is_member):
        hinge = scope.hinges.find(name.hinge)
        if hinge is None:
            return scope.hinges.missing(name.hinge, repr(name.hinge))
        return _index_problem_of_hinge(name, scope.hinges[hinge], name.hinge)
    if name.quantity in POINT_QUANTITIES:
        return _position_problem(name, scope)
    if scope.hinges.find(name.hinge) is not None:
        return f"{name.text!r} is unknown; a hinge has {name.hinge}.q and {name.hinge}.u"
    if scope.positions and scope.bodies.find(name.owner) is not None:
        return f"{name.text!r} is unknown; a body or end has x, y, z, vx, vy, vz"
    return f"{name.text!r} is unknown; write the name of a hinge and .q or .u"


def _bare_name_problem(name: Name, scope: Scope) -> str | None:
    word = name.parts[0]
    parameters: Collection[str] = scope.own.parameters if scope.own is not None else ()
    if word == "t" or word in parameters or word in scope.inputs:
        return None if name.index is None else f"{word!r} is a scalar; leave out [{name.index}]"
    if word in ("q", "u"):
        if scope.own is not None:
            return _index_problem_of_hinge(name, scope.own, scope.own.name)
        if scope.spring:
            return None if name.index in (None, 0) else f"{name.text!r}: a spring has one length"
        return f"{name.text!r} needs the name of a hinge, as in shoulder.{word}"
    own_quantities = ["q", "u"] if scope.own is not None or scope.spring else []
    known_names = ["t", *own_quantities, "pi", *parameters, *scope.inputs, *current_constants()]
    return f"{word!r} is unknown{did_you_mean(word, known_names)}"


def _modal_name_problem(name: Name, modes: ModalNames) -> str | None:
    """Message about an undefined modal coordinate or rate; defined are blade.q[0], blade.u[0]."""
    if len(name.parts) == 2 and name.quantity in ("q", "u"):
        if modes is None:
            if name.index is not None:
                return None
            return f"{name.text!r}: give the index of the shape, as in {name.text}[0]"
        return index_problem(name, name.owner, len(modes), "flexible body")
    if len(name.parts) == 2 and name.quantity in (modes or ()):
        index = (modes or ()).index(name.quantity)
        return f"{name.text!r} is unknown; write {name.owner}.q[{index}]"
    return (
        f"{name.text!r} is unknown; a flexible body has {name.owner}.q[0], "
        f"{name.owner}.u[0], and in events x, y, z, vx, vy, vz of it and its ends"
    )


def _curve_name_problem(name: Name) -> str | None:
    """Message about an undefined quantity of a point on a curve, other than wire.s, wire.s_rate."""
    if len(name.parts) == 2 and name.quantity in CURVE_QUANTITIES and name.index is None:
        return None
    curve_text = " and ".join(f"{name.owner}.{quantity}" for quantity in CURVE_QUANTITIES)
    return f"{name.text!r} is unknown; a point on a curve has {curve_text}"


def _index_problem_of_hinge(name: Name, hinge: Hinge, called: str) -> str | None:
    """Message about a missing coordinate of a built-in hinge; others are checked by definition."""
    facts = hinge.builtin
    if facts is None:
        return None
    entries = facts.coordinates if name.quantity == "q" else facts.speeds
    return index_problem(name, called, len(entries))


def index_problem(name: Name, hinge: str, count: int, word: str = "hinge") -> str | None:
    """Message about an index that a hinge with `count` coordinates does not have, or None."""
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


def _position_problem(name: Name, scope: Scope) -> str | None:
    if not scope.positions:
        return (
            f"{name.text!r}: positions and velocities of bodies are available only in events and "
            "release; use q and u of hinges"
        )
    if name.index is not None:
        return f"{name.text!r} is a scalar; leave out [{name.index}]"
    ends = scope.bodies.ends(name.owner)
    if ends is None:
        return scope.bodies.missing(name.owner, repr(name.owner))
    end = ".".join(name.parts[1:-1])
    if end and end not in ends:
        return f'body "{name.owner}" has no end {end!r}{did_you_mean(end, ends)}'
    return None
