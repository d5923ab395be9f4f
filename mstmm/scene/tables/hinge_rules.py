"""What a hinge of each type takes: keys, start values, drive, law; defaults filled in."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from ...errors import ExpressionError
from ...expression.drive import jump, motion_at
from ...expression.expression import Expression
from ...numbers.rotations import cross, norm, perpendicular, unit
from ..rules.values import Location, Refused, counted, found, quaternion
from .hinge_keys import HingeKeys, Initial
from .hinge_types import HINGE_TYPES, HingeType, effort_unit
from .law import Law, LawEntry

_Z = (0.0, 0.0, 1.0)
_X = (1.0, 0.0, 0.0)
#: Start values of a driven coordinate must agree with the drive to this accuracy.
_AGREES = 1e-9


def settled(hinge: HingeKeys) -> dict[str, Any]:
    """Fields with their defaults filled in; Refused names everything that does not fit."""
    problems = hinge.misplaced()
    changes: dict[str, Any] = {}
    kind = hinge.builtin
    if kind is None:
        problems += _user_type(hinge)
        if problems:
            raise Refused(*problems)
        return changes
    changes |= _axes(hinge, kind, problems)
    changes["law"] = _law(hinge, kind, problems)
    drive = _drive(hinge, kind, problems)
    changes["drive"] = drive
    if hinge.parameters:
        problems.append((
            ("parameters",),
            f'a {kind.name} hinge has no parameters; '
            "name them in the type of your own hinge",
        ))  # fmt: skip
    if hinge.lets_go and drive is None and kind.coordinates:
        problems.append((
            ("release",),
            "only a driven or fixed hinge can be released; add a drive or leave it out",
        ))  # fmt: skip
    if not problems:
        changes["initial"] = _initial(hinge, kind, drive, problems)
    if problems:
        raise Refused(*problems)
    return changes


def _user_type(hinge: HingeKeys) -> list[tuple[Location, str]]:
    """A user's type takes parameters instead of the keys of the built-in types."""
    return [
        ((key,), f'only built-in types take {key}; give "{hinge.type}" its numbers as parameters')
        for key in ("axis2", "normal", "lead")
        if getattr(hinge, key) is not None
    ]


def _axes(
    hinge: HingeKeys, kind: HingeType, problems: list[tuple[Location, str]]
) -> dict[str, Any]:
    """axis, axis2, normal and lead, each where the type has it."""
    for key in ("axis2", "lead"):
        if key not in kind.keys and getattr(hinge, key) is not None:
            problems.append(((key,), f"{a_hinge(kind.name)} has no {key}; leave it out"))
    if hinge.normal is not None and kind.name != "planar":
        problems.append((("normal",), f"{a_hinge(kind.name)} has no normal; write axis"))
    if "axis" not in kind.keys and hinge.axis != _Z:
        way_out = "turn it by orientation" if kind.name == "gimbal" else "leave it out"
        problems.append((("axis",), f"a {kind.name} hinge has no axis; {way_out}"))
    if kind.name == "screw" and (hinge.lead is None or hinge.lead == 0):
        problems.append((
            ("lead",),
            "a screw needs its lead in m per turn, not 0; write for example lead = 0.01"
            + ("" if hinge.lead is None else ', or type = "pin"'),
        ))  # fmt: skip
    if kind.name == "planar":
        return _planar_axes(hinge, problems)
    if kind.name == "universal":
        if hinge.axis2 is None:
            problems.append((
                ("axis2",), "a universal hinge needs its second axis; write for example [0, 1, 0]"
            ))  # fmt: skip
        else:
            _not_collinear("axis2", hinge.axis2, "axis", hinge.axis, problems)
    return {}


def _planar_axes(hinge: HingeKeys, problems: list[tuple[Location, str]]) -> dict[str, Any]:
    """The normal under both its names, and the direction of x in the plane."""
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
            (key,), f"{key} {found(a)} is parallel to {other} {found(b)}; turn one of them"
        ))  # fmt: skip


# --- law ------------------------------------------------------------------------------------------


def _law(hinge: HingeKeys, kind: HingeType, problems: list[tuple[Location, str]]) -> Law:
    """The law with one entry per speed."""
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
                f"one number cannot stand for all coordinates of {a_hinge(kind.name)}, whose "
                f"efforts are in {units}; give a list with {count} entries",
            ))  # fmt: skip
        changes[key] = values * count if len(values) == 1 else values or (default,) * count
    if kind.quaternion is not None:
        problems += _rotation_law(kind, changes)
    return law.model_copy(update=changes)


@cache
def _neutral(law: type[Law]) -> LawEntry:
    """The law that does nothing."""
    return law().entry(0)


def a_hinge(type_name: str) -> str:
    """The type with its article."""
    return f"{'an' if type_name[0] in 'aeio' else 'a'} {type_name} hinge"


def entries_of(type_name: str, coordinates: tuple[Any, ...]) -> str:
    """How many entries a list has and what they are."""
    names = ", ".join(f"{c.name} ({c.unit})" if c.unit else c.name for c in coordinates)
    return f"{counted(len(coordinates))} for {a_hinge(type_name)}" + (f": {names}" if names else "")


def _units_differ(kind: HingeType) -> bool:
    return len({s.unit for s in kind.speeds}) > 1


def _rotation_law(kind: HingeType, law: dict[str, Any]) -> list[tuple[Location, str]]:
    """A rotation stored as a quaternion has no angle to rest at or to stop."""
    problems: list[tuple[Location, str]] = []
    if any(law["rest"][-3:]):
        problems.append((
            ("law", "rest"),
            f"the rotation of {a_hinge(kind.name)} rests where it is not turned; "
            "write 0 there and turn orientation instead",
        ))  # fmt: skip
    if any(stop.acts for stop in law["limits"]):
        problems.append((
            ("law", "limits"),
            f"{a_hinge(kind.name)} has no limits; use pin, universal or gimbal hinges",
        ))  # fmt: skip
    return problems


# --- drive and start values -----------------------------------------------------------------------


def _drive(
    hinge: HingeKeys, kind: HingeType, problems: list[tuple[Location, str]]
) -> tuple[Expression | None, ...] | None:
    drive = hinge.drive
    if drive is None or (drive and all(entry is None for entry in drive)):
        return None
    if kind.quaternion is not None:
        instead = "gimbal or universal" if kind.name == "ball" else "gimbal, planar or prismatic"
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
        if not entry.depends_on_time_only:
            other = next(n.text for n in entry.names if n.text != "t")
            problems.append((
                place, f"a drive depends on t alone, found {other!r}; use law.effort for feedback"
            ))  # fmt: skip
        else:
            problems += _unsmooth(entry, place)
    return drive


def _unsmooth(entry: Expression, place: Location) -> list[tuple[Location, str]]:
    """A drive whose start is not finite or whose derivatives cannot be formed."""
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
        "begin with a smooth motion, for example t^2",
    )]  # fmt: skip


def _initial(
    hinge: HingeKeys,
    kind: HingeType,
    drive: tuple[Expression | None, ...] | None,
    problems: list[tuple[Location, str]],
) -> Initial | None:
    """Start values, filled in; None when a drive gives all of them."""
    given = hinge.initial
    if drive is not None and None not in drive:
        if given is not None and (given.q is not None or given.u is not None):
            problems.append((
                ("initial",),
                "a drive stands instead of initial: it gives the start values itself; "
                "leave one of them out",
            ))  # fmt: skip
        return None
    start = [(0.0, 0.0, 0.0) if d is None else motion_at(d, 0.0) for d in drive or ()]
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


def _start_values(
    kind: HingeType,
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
        if entry is not None and abs(given[k] - default[k]) > _AGREES * max(1.0, abs(default[k])):
            problems.append((
                ("initial", key, k),
                f"{given[k]:g} contradicts the drive, which begins at {default[k]:g}; write that, "
                'or "free" in the drive',
            ))  # fmt: skip
    return given


def near_type(name: str, known: set[str]) -> str | None:
    """The known hinge type nearest to `name`."""
    import difflib

    close = difflib.get_close_matches(name.lower(), sorted(known | set(HINGE_TYPES)), 1, 0.6)
    return close[0] if close else None
