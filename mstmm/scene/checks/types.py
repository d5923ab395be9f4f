"""Checks of elements with user-defined types against the definitions of these types."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ...expression.expression import Expression
from ...ir.facts import builtin_hinges, effort_unit
from ...ir.spec import ElementSpec
from ..rules.messages import Problem, near
from ..rules.values import Location, Refused
from ..rules.words import ours
from ..tables.hinge_rules import misplaced_keys, settled_as
from .names import index_problem

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.hinge import HingeTable

#: Table of the scene -> (kind of the definition, built-in types).
_KINDS = {
    "body": ("body", ("rigid",)),
    "hinge": ("hinge", tuple(builtin_hinges())),
    "spring": ("force", ("spring",)),
}


def tables(scene: SceneTables) -> Iterator[tuple[str, Location, Any]]:
    """Yield (kind, location, table) of every element with a type, chain patterns included."""
    for table, (kind, _) in _KINDS.items():
        for i, element in enumerate(getattr(scene, table)):
            yield kind, (table, i), element
    for i, chain in enumerate(scene.chain):
        for table in ("body", "hinge"):
            for k, element in enumerate(getattr(chain, table)):
                yield _KINDS[table][0], ("chain", i, table, k), element


def types(scene: SceneTables) -> set[tuple[str, str]]:
    """Set of (kind, type) of all elements of a scene."""
    return {(kind, element.type) for kind, _, element in tables(scene)}


def problems(scene: SceneTables, known: Mapping[tuple[str, str], ElementSpec]) -> list[Problem]:
    """Problems of unknown types, and of elements that do not fit their definition."""
    found: list[Problem] = []
    builtin = dict(_KINDS.values())
    for kind, place, element in tables(scene):
        if element.type in builtin[kind]:
            continue
        spec = known.get((kind, element.type))
        if spec is None:
            mine = [name for k, name in known if k == kind]
            called = ours(element.type) if kind == "hinge" else None
            hint = near(element.type, [*builtin[kind], *mine])
            hint = f'; use "{called}"' if called else hint
            found.append(((*place, "type"), f'unknown {kind} type "{element.type}"{hint}'))
        else:
            found += _element(scene, place, element, spec)
    return found


def learn(scene: SceneTables, known: Mapping[tuple[str, str], ElementSpec]) -> list[Problem]:
    """Store the facts of user-defined types in their hinges, and resolve their defaults.

    Returns the problems found.
    """
    found: list[Problem] = []
    for kind, place, element in tables(scene):
        spec = known.get((kind, element.type))
        if spec is not None and spec.facts is not None:
            vars(element)["facts"] = spec.facts
            try:
                vars(element).update(settled_as(element, spec.facts))
            except Refused as refused:
                found += [((*place, *at), text) for at, text in refused.problems]
    return found


def inherit(scene: SceneTables, other: SceneTables) -> None:
    """Copy the facts of user-defined hinge types from a scene with the same elements."""
    for (_, _, mine), (_, _, known) in zip(tables(scene), tables(other), strict=True):
        if getattr(known, "builtin", known) is None and known.facts is not None:
            vars(mine)["facts"] = known.facts


def problems_with(scene: SceneTables, spec: ElementSpec) -> list[Problem]:
    """Problems of the elements of one user-defined type."""
    return [
        problem
        for kind, place, element in tables(scene)
        if kind == spec.kind and element.type == spec.name
        for problem in _element(scene, place, element, spec)
    ]


def _element(
    scene: SceneTables, place: Location, element: Any, spec: ElementSpec
) -> Iterator[Problem]:
    yield from _parameters(place, element.parameters, spec)
    if spec.kind == "hinge":
        for at, text in misplaced_keys(element, spec.facts):
            yield (*place, *at), text
        yield from _counts(place, element, spec)
        yield from _indices(scene, element, spec)


def _parameters(
    place: Location, given: Mapping[str, float], spec: ElementSpec
) -> Iterator[Problem]:
    own = spec.parameters if spec.facts is None else spec.facts.own_parameters()
    known = {p.name: p for p in own}
    for name, value in given.items():
        at = (*place, "parameters", name)
        parameter = known.get(name)
        if parameter is None:
            yield at, f'{spec.name} has no parameter "{name}"{near(name, known)}'
        elif parameter.minimum is not None and value < parameter.minimum:
            yield at, f"expected {parameter.minimum:g} {parameter.unit} or more, found {value:g}"
        elif parameter.maximum is not None and value > parameter.maximum:
            yield at, f"expected {parameter.maximum:g} {parameter.unit} or less, found {value:g}"
    for parameter in own:
        if parameter.default is None and parameter.name not in given:
            unit = f" in {parameter.unit}" if parameter.unit else ""
            meaning = f" ({parameter.meaning})" if parameter.meaning else ""
            at = (*place, "parameters", parameter.name)
            yield at, f"missing; expected a number{unit}{meaning}"


def _counts(place: Location, hinge: HingeTable, spec: ElementSpec) -> Iterator[Problem]:
    """Problems of the lengths of initial values, drive and law."""
    lists: list[tuple[Location, Any, int]] = []
    if hinge.initial is not None:
        lists.append((("initial", "q"), hinge.initial.q, len(spec.coordinates)))
        lists.append((("initial", "u"), hinge.initial.u, len(spec.speeds)))
    if hinge.drive is not None:
        lists.append((("drive",), hinge.drive, len(spec.coordinates)))
        if len(spec.coordinates) != len(spec.speeds):
            yield (
                (*place, "drive"),
                f"{spec.name} cannot be driven: it has {len(spec.coordinates)} coordinates and "
                f"{len(spec.speeds)} speeds",
            )
    for key in type(hinge.law).model_fields:
        values = getattr(hinge.law, key)
        if len(values) > 1 or (values and not spec.speeds):
            lists.append((("law", key), values, len(spec.speeds)))
        elif values and len({s.unit for s in spec.speeds}) > 1:
            units = ", ".join(effort_unit(s.unit) for s in spec.speeds)
            yield (
                (*place, "law", key),
                f"one number cannot be used for efforts in {units}; "
                f"give a list with {len(spec.speeds)} entries",
            )
    for at, values, count in lists:
        if values is not None and len(values) != count:
            yield (*place, *at), f"expected {count} entries for {spec.name}, found {len(values)}"


def _indices(scene: SceneTables, hinge: HingeTable, spec: ElementSpec) -> Iterator[Problem]:
    """Problems of indices of a hinge's coordinates in all expressions of the scene."""
    for place, expression, own in _all_expressions(scene):
        for name in expression.names:
            if name.quantity not in ("q", "u"):
                continue
            meant = own if len(name.parts) == 1 else _table(scene, name.hinge)
            if meant is not hinge:
                continue
            entries = spec.coordinates if name.quantity == "q" else spec.speeds
            message = index_problem(name, name.hinge or _called(scene, place), len(entries))
            if message is not None:
                yield place, message


def _called(scene: SceneTables, place: Location) -> str:
    """Name of the hinge at a location; for a chain pattern, of the first member with it."""
    if place[0] == "chain":
        return scene.hinges.name(scene.hinges.starts[int(place[1])] + int(place[3]))
    return scene.hinge[int(place[1])].name


def _table(scene: SceneTables, name: str) -> HingeTable | None:
    """Table of the hinge with this name, or None."""
    index = scene.hinges.find(name)
    if index is None or index < len(scene.hinge):
        return None if index is None else scene.hinge[index]
    chain, k = scene.hinges.member(index)
    return scene.chain[chain].hinge_of(k)


def _all_expressions(
    scene: SceneTables,
) -> Iterator[tuple[Location, Expression, HingeTable | None]]:
    """Yield (location, expression, hinge whose q and u need no prefix) of all expressions."""
    for kind, place, table in tables(scene):
        if kind == "hinge":
            for k, effort in enumerate(table.law.effort):
                yield (*place, "law", "effort", k), effort, table
    for i, hinge in enumerate(scene.hinge):
        if hinge.release is not None:
            yield ("hinge", i, "release"), hinge.release, hinge
    for i, load in enumerate(scene.load):
        for key in ("force", "moment", "force_per_length"):
            for k, entry in enumerate(getattr(load, key) or ()):
                yield ("load", i, key, k), entry, None
    for i, event in enumerate(scene.event):
        yield ("event", i, "when"), event.when, None
    for i, spring in enumerate(scene.spring):
        yield ("spring", i, "law", "effort"), spring.law.effort, None
    for i, coupling in enumerate(scene.coupling):
        yield ("coupling", i, coupling.key), coupling.row, None
