"""Checks of couplings: defined names, differentiable expressions, free coordinates."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING

from ...expression.drive import motion_at
from ...expression.expression import Expression, Name
from ...expression.parser import around
from ...expression.slope import parted, slopes
from ..rules.messages import Problem
from ..rules.values import Location, found
from ..tables.hinge_rules import unsmooth
from .closures import coordinate
from .inputs import switching
from .names import flexible, index_problem

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.closures import Coupling
    from ..tables.hinge import Hinge


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of couplings, as far as the types of their hinges are defined."""
    seen: dict[str, int] = {}
    for i, coupling in enumerate(scene.coupling):
        place: Location = ("coupling", i, coupling.key)
        named = [(place, said) for name in coupling.names
                 if (said := _unknown(scene, name, coupling.key)) is not None]  # fmt: skip
        yield from named
        if not named and _are_known(scene, coupling):
            yield from ((place, said) for said in _no_row(scene, coupling) if said is not None)
        yield from _right_side(coupling, ("coupling", i, "equals"))
        first = seen.setdefault(coupling.row.text.replace(" ", ""), i)
        if first != i:
            yield place, f"repeats coupling number {first + 1}; leave one out"


def _are_known(scene: SceneTables, coupling: Coupling) -> bool:
    """Whether the types of all hinges of a coupling are defined."""
    return all(scene.hinges.by_name[name.hinge].facts is not None for name in coupling.names)


def _right_side(coupling: Coupling, place: Location) -> Iterator[Problem]:
    equals = coupling.equals
    if equals is None:
        return
    others = [name for name in equals.names if name.text != "t"]
    if others:
        named = f"{others[0].text!r}{around(equals.text, others[0])}"
        yield place, f"expected a function of t only, found {named}; move it to the coupling"
    else:
        yield from unsmooth(equals, place)


# --- names ----------------------------------------------------------------------------------------


def _unknown(scene: SceneTables, name: Name, key: str) -> str | None:
    """Message about a name that is no coordinate or speed of a hinge; None for others."""
    if name.text == "t" or name.text in scene.channels:
        return f"{name.text!r} is no coordinate of a hinge; write functions of time in equals"
    if len(name.parts) == 1:
        return f"{name.text!r} is no coordinate; write the name of a hinge and .q or .u"
    if name.owner in flexible(scene):
        return f"{name.text!r} is no coordinate of a hinge; couplings accept only those of hinges"
    number = scene.hinges.find(name.hinge)
    if number is None:
        return scene.hinges.missing(name.hinge, repr(name.hinge))
    if key == "expression" and name.quantity == "u":
        return f"{name.text!r} is a speed; use speeds in place of expression"
    return _no_entry(scene.hinges[number], name, key)


def _no_entry(hinge: Hinge, name: Name, key: str) -> str | None:
    """Message about a coordinate or speed that a hinge does not have; None for others."""
    facts = hinge.facts
    if facts is None:
        return None
    own = [one.name for one in facts.coordinates]
    entry = name.index or 0
    if name.quantity in ("q", "u"):
        entries = facts.coordinates if name.quantity == "q" else facts.speeds
        problem = index_problem(name, hinge.name, len(entries))
        if problem is not None:
            return problem
    elif name.quantity not in own or name.index is not None:
        known = "".join(f", {hinge.name}.{one}" for one in own)
        return f"{name.text!r} is unknown; this hinge has {hinge.name}.q{known}"
    else:
        entry = own.index(name.quantity)
    first = facts.quaternion
    if key == "expression" and first is not None and first <= entry < first + 4:
        return (
            f"{name.text!r} is an entry of a quaternion, not an angle; use universal or "
            "gimbal hinges, or couple speeds"
        )
    return None


# --- rows -----------------------------------------------------------------------------------------


def _no_row(scene: SceneTables, coupling: Coupling) -> Iterator[str | None]:
    """Reasons why an expression of existing coordinates and speeds gives no constraint row."""
    row, names = coupling.row, coupling.names
    kept = [name for name in names if coupling.expression is not None or name.quantity == "u"]
    switch = switching(row, {name.text for name in names})
    if switch:
        yield f"no derivative where {switch!r} switches; use a smooth expression"
        return
    if not kept:
        yield f"{found(row.text)} has no speed, as in cart.u; use expression in place of speeds"
        return
    ways, rest = parted(row, kept)
    idle = [name.text for name, way in zip(kept, ways, strict=True) if way is None]
    if idle:
        yield f"{idle[0]!r} has no effect; leave it out"
    if coupling.speeds is not None and any(set(way or ()) & set(kept) for way in ways):
        yield "not linear in the speeds; write a sum of speeds with factors that contain none"
    elif coupling.speeds is not None and rest:
        yield "a term has no speed; move it to equals"
    else:
        yield _no_slope(scene, row, kept)
        yield _all_driven(scene, kept)


def _no_slope(scene: SceneTables, row: Expression, kept: Collection[Name]) -> str | None:
    """Message about a row that is not finite or has no derivatives at the start."""
    known = {name: _start(scene, name) for name in row.names}
    found = slopes(row, known.__getitem__)
    at = ", ".join(f"{name.text} = {known[name]:g}" for name in row.names[:4])
    if not all(map(math.isfinite, (row.evaluate(known.__getitem__), *found.values()))):
        return (
            f"the expression or one of its derivatives is not finite at the start ({at}); use "
            "another initial state"
        )
    if not any(found[name] for name in kept):
        return (
            f"all derivatives are 0 at the start ({at}), so the direction of motion is undefined; "
            "use another initial state, or an expression without the square"
        )
    return None


def _start(scene: SceneTables, name: Name) -> float:
    number, kind, entry = coordinate(scene, name)
    hinge = scene.hinges[number]
    drive = (hinge.drive or ())[entry : entry + 1]
    if hinge.initial is None and drive and drive[0] is not None:
        if not drive[0].depends_on_time_only:
            return 0.0
        return motion_at(drive[0], 0.0)[0 if kind == "q" else 1]
    given = hinge.initial and (hinge.initial.q if kind == "q" else hinge.initial.u)
    return given[entry] if given and entry < len(given) else 0.0


def _all_driven(scene: SceneTables, names: list[Name]) -> str | None:
    """Message about a coupling of driven coordinates only; released hinges are not driven."""
    let_go = {event.hinge for event in scene.event}
    for name in names:
        number, _, entry = coordinate(scene, name)
        hinge = scene.hinges[number]
        if hinge.lets_go or hinge.name in let_go or not any((hinge.drive or ())[entry : entry + 1]):
            return None
    which = " and ".join(dict.fromkeys(name.text for name in names))
    return f"drives already prescribe {which}; leave out one drive or the coupling"
