"""Couplings: what they name, whether it can be differentiated, and whether anything is left to
couple."""

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
    """Everything for which a coupling is no row, as far as the types of its hinges are known."""
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
            yield place, f"coupling number {first + 1} couples the same; leave one out"


def _are_known(scene: SceneTables, coupling: Coupling) -> bool:
    """Whether all types of its hinges have been defined."""
    return all(scene.hinges.by_name[name.hinge].facts is not None for name in coupling.names)


def _right_side(coupling: Coupling, place: Location) -> Iterator[Problem]:
    equals = coupling.equals
    if equals is None:
        return
    others = [name for name in equals.names if name.text != "t"]
    if others:
        named = f"{others[0].text!r}{around(equals.text, others[0])}"
        yield place, f"it depends on t alone, found {named}; write that in the coupling"
    else:
        yield from unsmooth(equals, place)


# --- names ----------------------------------------------------------------------------------------


def _unknown(scene: SceneTables, name: Name, key: str) -> str | None:
    """Why a name means no coordinate and no speed; None where it means one."""
    if name.text == "t" or name.text in scene.channels:
        return f"{name.text!r} is no coordinate of a hinge; what goes by time belongs to equals"
    if len(name.parts) == 1:
        return f"{name.text!r} is no coordinate; write the name of a hinge and .q or .u"
    if name.owner in flexible(scene):
        return f"{name.text!r} is no coordinate of a hinge, and couplings are of hinges alone"
    number = scene.hinges.find(name.hinge)
    if number is None:
        return scene.hinges.missing(name.hinge, repr(name.hinge))
    if key == "expression" and name.quantity == "u":
        return f"{name.text!r} is a speed; write speeds in place of expression"
    return _no_entry(scene.hinges[number], name, key)


def _no_entry(hinge: Hinge, name: Name, key: str) -> str | None:
    """Why a hinge has no such coordinate or speed."""
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
        return f"{name.text!r} is unknown; of this hinge there is {hinge.name}.q{known}"
    else:
        entry = own.index(name.quantity)
    first = facts.quaternion
    if key == "expression" and first is not None and first <= entry < first + 4:
        return (
            f"{name.text!r} is an entry of a quaternion, which is no angle; use universal or "
            "gimbal hinges, or couple speeds"
        )
    return None


# --- rows -----------------------------------------------------------------------------------------


def _no_row(scene: SceneTables, coupling: Coupling) -> Iterator[str | None]:
    """Why an expression of coordinates and speeds that there are gives no row."""
    row, names = coupling.row, coupling.names
    kept = [name for name in names if coupling.expression is not None or name.quantity == "u"]
    switch = switching(row, {name.text for name in names})
    if switch:
        yield f"it has no slope where {switch!r} switches; write it without"
        return
    if not kept:
        yield f"{found(row.text)} names no speed, as in cart.u; write expression in place of speeds"
        return
    ways, rest = parted(row, kept)
    idle = [name.text for name, way in zip(kept, ways, strict=True) if way is None]
    if idle:
        yield f"it does not change with {idle[0]!r}; leave that out"
    if coupling.speeds is not None and any(set(way or ()) & set(kept) for way in ways):
        yield "it is not linear in the speeds; write a sum of speeds times what is none"
    elif coupling.speeds is not None and rest:
        yield "it has a part without speeds; write that in equals"
    else:
        yield _no_slope(scene, row, kept)
        yield _all_driven(scene, kept)


def _no_slope(scene: SceneTables, row: Expression, kept: Collection[Name]) -> str | None:
    """A row that is not finite at the start, or does not change there with any of what it keeps."""
    known = {name: _start(scene, name) for name in row.names}
    found = slopes(row, known.__getitem__)
    at = ", ".join(f"{name.text} = {known[name]:g}" for name in row.names[:4])
    if not all(map(math.isfinite, (row.evaluate(known.__getitem__), *found.values()))):
        return f"it or one of its slopes is not finite at the start ({at}); start elsewhere"
    if not any(found[name] for name in kept):
        return (
            f"all of its slopes are 0 at the start ({at}), so nothing tells which way it goes; "
            "start beside, or write what it keeps without the square"
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
    """A coupling of driven coordinates alone; one that is let go is driven no longer."""
    let_go = {event.hinge for event in scene.event}
    for name in names:
        number, _, entry = coordinate(scene, name)
        hinge = scene.hinges[number]
        if hinge.lets_go or hinge.name in let_go or not any((hinge.drive or ())[entry : entry + 1]):
            return None
    which = " and ".join(dict.fromkeys(name.text for name in names))
    return f"a drive says already how {which} goes; leave one drive or the coupling out"
