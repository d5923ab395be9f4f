"""Checks and defaults of a hinge by its type: keys, initial values, drive, law."""

from __future__ import annotations

import math
from functools import cache
from typing import Any, TypeGuard

from ...errors import ExpressionError
from ...expression.drive import jump, motion_at
from ...expression.expression import Expression
from ...expression.parser import around
from ...ir.facts import HingeFacts, effort_unit
from ...numbers.rotations import cross, norm, perpendicular, unit
from ..rules import written
from ..rules.turns import quaternion
from ..rules.values import Location, Refused, counted, found
from .hinge_keys import HingeKeys, Initial
from .law import Law, LawEntry

_Z = (0.0, 0.0, 1.0)
_X = (1.0, 0.0, 0.0)
#: Largest difference of initial values of a driven coordinate from its drive, relative above 1.
_AGREES = 1e-9


def settled(hinge: HingeKeys) -> dict[str, Any]:
    """Resolve the defaults of a hinge: changed fields.  Raises Refused with all problems.

    Hinges of user-defined types are resolved by `settled_as` when their definition is available.
    """
    problems = hinge.misplaced()
    changes: dict[str, Any] = {}
    if hinge.builtin is not None:
        if hinge.parameters:
            problems.append((
                ("parameters",),
                f"a {hinge.type} hinge has no parameters; only user-defined types have them",
            ))  # fmt: skip
        changes = _settled(hinge, hinge.builtin, problems)
    if problems:
        raise Refused(*problems)
    return changes


def settled_as(hinge: HingeKeys, facts: HingeFacts) -> dict[str, Any]:
    """Resolve the defaults of a hinge of a user-defined type with these facts.

    Raises Refused with all problems.
    """
    problems: list[tuple[Location, str]] = []
    changes = _settled(hinge, facts, problems)
    if problems:
        raise Refused(*problems)
    return changes


def _settled(
    hinge: HingeKeys, kind: HingeFacts, problems: list[tuple[Location, str]]
) -> dict[str, Any]:
    changes = _axes(hinge, kind, problems)
    changes["law"] = _law(hinge, kind, problems)
    drive = _drive(hinge, kind, problems)
    changes["drive"] = drive
    if hinge.lets_go and drive is None and kind.coordinates:
        problems.append((
            ("release",),
            "only a driven or fixed hinge can be released; add a drive, or leave it out",
        ))  # fmt: skip
    if hinge.holds and not kind.coordinates:
        problems.append((("hold",), f"{a_hinge(kind.name)} has no coordinates; leave it out"))
    elif hinge.holds and drive is not None and None not in drive:
        problems.append((("hold",), "the drive gives the initial values; leave it out"))
    if not problems:
        changes["initial"] = _initial(hinge, kind, drive, problems)
    return changes


def misplaced_keys(hinge: HingeKeys, facts: HingeFacts | None) -> list[tuple[Location, str]]:
    """Problems of unused or missing keys of a hinge with a user-defined type."""
    problems: list[tuple[Location, str]] = []
    if facts is not None:
        _axes(hinge, facts, problems)
        return problems
    given = [key for key in ("axis2", "normal", "lead") if getattr(hinge, key) is not None]
    return [((key,), f"{a_hinge(hinge.type)} has no {key}; leave it out") for key in given]


def _axes(
    hinge: HingeKeys, kind: HingeFacts, problems: list[tuple[Location, str]]
) -> dict[str, Any]:
    """Check axis, axis2, normal and lead for a type; return changed fields."""
    for key in ("axis2", "lead"):
        if key not in kind.keys and getattr(hinge, key) is not None:
            problems.append(((key,), f"{a_hinge(kind.name)} has no {key}; leave it out"))
    if hinge.normal is not None and kind.frame != "plane":
        problems.append((("normal",), f"{a_hinge(kind.name)} has no normal; use axis"))
    if "axis" not in kind.keys and hinge.axis != _Z:
        way_out = "leave it out" if kind.welds else "rotate it by orientation"
        problems.append((("axis",), f"{a_hinge(kind.name)} has no axis; {way_out}"))
    if "lead" in kind.keys and (hinge.lead is None or hinge.lead == 0):
        problems.append((
            ("lead",),
            f"a {kind.name} needs its lead in m per turn, not 0; write for example lead = 0.01"
            + ("" if hinge.lead is None else ', or type = "pin"'),
        ))  # fmt: skip
    if kind.frame == "plane":
        return _planar_axes(hinge, problems)
    if kind.frame == "crossing":
        if hinge.axis2 is None:
            problems.append((
                ("axis2",),
                f"{a_hinge(kind.name)} needs its second axis; write for example [0, 1, 0]",
            ))  # fmt: skip
        else:
            _not_collinear("axis2", hinge.axis2, "axis", hinge.axis, problems)
    return {}


def _planar_axes(hinge: HingeKeys, problems: list[tuple[Location, str]]) -> dict[str, Any]:
    """Resolve the normal under both its keys, and the direction of x in the plane."""
    normal = hinge.axis if hinge.normal is None else hinge.normal
    if hinge.normal is not None and hinge.axis not in (_Z, hinge.normal):
        problems.append((
            ("axis",), f"axis {found(hinge.axis)} and normal {found(hinge.normal)} differ; give one"
        ))  # fmt: skip
    in_plane = hinge.axis2
    if in_plane is None:
        in_plane = _X if normal == _Z else perpendicular(normal)
    _not_collinear("axis2", in_plane, "normal", normal, problems)
    return {"axis": normal, "normal": normal, "axis2": in_plane}


def _not_collinear(
    key: str, a: tuple[float, ...], other: str, b: tuple[float, ...],
    problems: list[tuple[Location, str]],
) -> None:  # fmt: skip
    if norm(cross(unit(a), unit(b))) < 1e-6:
        problems.append((
            (key,), f"{key} {found(a)} is parallel to {other} {found(b)}; change one of them"
        ))  # fmt: skip


# --- law ------------------------------------------------------------------------------------------


def _law(hinge: HingeKeys, kind: HingeFacts, problems: list[tuple[Location, str]]) -> Law:
    """Resolve the law to one entry per speed."""
    law, count = hinge.law, len(kind.speeds)
    neutral = _neutral(type(law))
    changes: dict[str, Any] = {}
    for key in type(law).model_fields:
        values, default = getattr(law, key), getattr(neutral, key)
        place: Location = ("law", key)
        if len(values) > 1 and len(values) != count:
            problems.append((
                place, f"expected {entries_of(kind.name, kind.speeds)}, found {len(values)}"
            ))  # fmt: skip
        elif count == 0 and values:
            problems.append((place, "a fixed hinge has no coordinate for a law; leave it out"))
        elif len(values) == 1 and values[0] != default and _units_differ(kind):
            units = ", ".join(effort_unit(s.unit) for s in kind.speeds)
            problems.append((
                place,
                f"one number cannot be used for all coordinates of {a_hinge(kind.name)}, whose "
                f"efforts are in {units}; give a list with {count} entries",
            ))  # fmt: skip
        changes[key] = values * count if len(values) == 1 else values or (default,) * count
    if kind.quaternion is not None:
        problems += _rotation_law(kind, changes)
    turns = kind.quaternion is not None  # already reported by _rotation_law
    if not (kind.straight or turns) and any(stop.restitution for stop in changes["limits"]):
        problems.append((
            ("law", "limits"),
            f"the rates of {a_hinge(kind.name)} are not its speeds, which a hard stop reverses; "
            "give the stop a stiffness instead of a restitution",
        ))  # fmt: skip
    return law.model_copy(update=changes)


@cache
def _neutral(law: type[Law]) -> LawEntry:
    """Law without effect."""
    return law().entry(0)


def a_hinge(type_name: str) -> str:
    """Hinge type with its article: "a pin hinge"."""
    return f"{'an' if type_name[0] in 'aeio' else 'a'} {type_name} hinge"


def entries_of(type_name: str, coordinates: tuple[Any, ...]) -> str:
    """Expected entries of a list as text: "2 entries for a universal hinge: ..."."""
    names = ", ".join(f"{c.name} ({c.unit})" if c.unit else c.name for c in coordinates)
    return f"{counted(len(coordinates))} for {a_hinge(type_name)}" + (f": {names}" if names else "")


def _units_differ(kind: HingeFacts) -> bool:
    return len({s.unit for s in kind.speeds}) > 1


def _rotation_law(kind: HingeFacts, law: dict[str, Any]) -> list[tuple[Location, str]]:
    """Problems of rest and limits for a rotation stored as a quaternion, which has no angle."""
    problems: list[tuple[Location, str]] = []
    if any(law["rest"][-3:]):
        problems.append((
            ("law", "rest"),
            f"the rest angle of the rotation of {a_hinge(kind.name)} is 0; "
            "write 0 and change orientation instead",
        ))  # fmt: skip
    if any(stop.acts for stop in law["limits"]):
        problems.append((
            ("law", "limits"),
            f"{a_hinge(kind.name)} has no limits; use pin, universal or gimbal hinges",
        ))  # fmt: skip
    return problems


# --- drive and start values -----------------------------------------------------------------------


def _drive(
    hinge: HingeKeys, kind: HingeFacts, problems: list[tuple[Location, str]]
) -> tuple[Expression | None, ...] | None:
    drive = hinge.drive
    if drive is None or (drive and all(entry is None for entry in drive)):
        return None
    if kind.quaternion is not None:
        instead = "gimbal, planar or prismatic" if kind.slides else "gimbal or universal"
        problems.append((
            ("drive",), f"{a_hinge(kind.name)} cannot be driven; use {instead} hinges"
        ))  # fmt: skip
    elif len(drive) != len(kind.speeds):
        problems.append((
            ("drive",),
            f"expected {entries_of(kind.name, kind.coordinates)}, found {len(drive)}",
        ))  # fmt: skip
    for k, entry in enumerate(drive):
        if entry is None:
            continue
        place: Location = ("drive", k) if len(drive) > 1 else ("drive",)
        others = [n for n in entry.names if n.text != "t" and n.text not in written.inputs()]
        if others:
            inputs = " and inputs" if written.inputs() else ""
            feedback = others[0].text.partition("[")[0] in ("q", "u") or len(others[0].parts) > 1
            way_out = (
                "; use law.effort for feedback"
                if feedback
                else written.unknown(entry.text, ("t", *written.inputs()))
            )
            problems.append((
                place,
                f"expected a function of t{inputs} only, found {others[0].text!r}"
                f"{around(entry.text, others[0])}{way_out}",
            ))  # fmt: skip
        elif entry.depends_on_time_only:
            problems += unsmooth(entry, place)
    return drive


def unsmooth(entry: Expression, place: Location) -> list[tuple[Location, str]]:
    """Problems of a drive: no finite start, no derivatives, or jumps."""
    try:
        start = motion_at(entry, 0.0)
    except ExpressionError as error:
        return [(place, str(error))]
    if all(math.isfinite(x) for x in start):
        breaks = [t for t in entry.time_breaks() if t >= 0]
        ways = ((math.nextafter(t, -math.inf), math.nextafter(t, math.inf)) for t in breaks)
        jumps = jump(entry, ways)
        return [(place, f"{found(entry.text)} {jumps}")] if jumps else []
    return [(
        place,
        f"{found(entry.text)} or one of its first two derivatives is not finite at t = 0; "
        "start with a smooth motion, for example t^2",
    )]  # fmt: skip


def _initial(
    hinge: HingeKeys,
    kind: HingeFacts,
    drive: tuple[Expression | None, ...] | None,
    problems: list[tuple[Location, str]],
) -> Initial | None:
    """Resolve the initial values; None where a drive gives all of them."""
    given = hinge.initial
    if drive is not None and None not in drive:
        if given is not None and (given.q is not None or given.u is not None):
            problems.append((
                ("initial",),
                "the drive already gives the initial values; leave one of them out",
            ))  # fmt: skip
        return None
    start = [motion_at(d, 0.0) if _goes_by_time(d) else (0.0, 0.0, 0.0) for d in drive or ()]
    default_q = tuple(s[0] for s in start) if drive else kind.start
    default_u = tuple(s[1] for s in start) if drive else (0.0,) * len(kind.speeds)
    q = _start_values(kind, "q", given.q if given else None, default_q, drive, problems)
    u = _start_values(kind, "u", given.u if given else None, default_u, drive, problems)
    if kind.quaternion is not None and len(q) == len(kind.start):
        at = kind.quaternion
        try:
            turned = quaternion(q[at : at + 4], "a quaternion w, x, y, z", "initial", "q")
            q = q[:at] + turned + q[at + 4 :]
        except Refused as refused:
            problems += refused.problems
    return Initial(q=q, u=u)


def _goes_by_time(drive: Expression | None) -> TypeGuard[Expression]:
    """Whether a coordinate has a drive that depends on time only; inputs are unknown here."""
    return drive is not None and drive.depends_on_time_only


def _start_values(
    kind: HingeFacts,
    key: str,
    given: tuple[float, ...] | None,
    default: tuple[float, ...],
    drive: tuple[Expression | None, ...] | None,
    problems: list[tuple[Location, str]],
) -> tuple[float, ...]:
    if given is None:
        return default
    if len(given) != len(default):
        names = kind.coordinates if key == "q" else kind.speeds
        problems.append((
            ("initial", key),
            f"expected {entries_of(kind.name, names)}, found {len(given)}",
        ))  # fmt: skip
        return given
    for k, entry in enumerate(drive or ()):
        if _goes_by_time(entry) and abs(given[k] - default[k]) > _AGREES * max(
            1.0, abs(default[k])
        ):
            problems.append((
                ("initial", key, k),
                f"expected {default[k]:g}, the start of the drive, found {given[k]:g}; correct "
                'it, or write "free" in the drive',
            ))  # fmt: skip
    return given
