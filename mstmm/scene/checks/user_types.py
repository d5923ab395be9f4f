"""Checks of elements with user-defined types against the definitions of these types."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from ...expression.expression import Expression
from ...ir.element_spec import ElementSpec
from ...ir.hinge_properties import builtin_hinges, effort_unit
from ..tables.hinge import resolve_defaults_for, unexpected_keys
from ..validators.scalars_and_vectors import Location, ValidationProblems
from ..validators.validation_messages import Problem, did_you_mean
from .expression_names import index_problem

if TYPE_CHECKING:
    from ..tables.hinge import HingeTable
    from ..tables.scene_tables import SceneTables

#: Table of the scene -> (kind of the definition, built-in types).
_KINDS_BY_TABLE = {
    "body": ("body", ("rigid",)),
    "hinge": ("hinge", tuple(builtin_hinges())),
    "spring": ("force", ("spring",)),
}


def typed_tables(scene: SceneTables) -> Iterator[tuple[str, Location, Any]]:
    """Yield (kind, location, table) of every element with a type, chain patterns included."""
    for table, (kind, _) in _KINDS_BY_TABLE.items():
        for i, element in enumerate(getattr(scene, table)):
            yield kind, (table, i), element
    for i, chain in enumerate(scene.chain):
        for table in ("body", "hinge"):
            for k, element in enumerate(getattr(chain, table)):
                yield _KINDS_BY_TABLE[table][0], ("chain", i, table, k), element


class SceneExpression(NamedTuple):
    """Expression of a scene, with its location, and the hinge whose q and u need no prefix.

    Conditions are those of events and releases.
    """

    location: Location
    expression: Expression
    own: HingeTable | None = None
    is_condition: bool = False


def scene_expressions(scene: SceneTables) -> Iterator[SceneExpression]:
    """Yield all expressions of a scene but drives, outputs and right sides of couplings."""
    for i, hinge in enumerate(scene.hinge):
        for k, effort in enumerate(hinge.law.effort):
            yield SceneExpression(("hinge", i, "law", "effort", k), effort, hinge)
        if hinge.release is not None:
            yield SceneExpression(("hinge", i, "release"), hinge.release, hinge, is_condition=True)
    for i, chain in enumerate(scene.chain):
        for j, pattern in enumerate(chain.hinge):
            for k, effort in enumerate(pattern.law.effort):
                location: Location = ("chain", i, "hinge", j, "law", "effort", k)
                yield SceneExpression(location, effort, pattern)
    for i, load in enumerate(scene.load):
        for key in ("force", "moment", "force_per_length"):
            for k, entry in enumerate(getattr(load, key) or ()):
                yield SceneExpression(("load", i, key, k), entry)
    for i, event in enumerate(scene.event):
        yield SceneExpression(("event", i, "when"), event.when, is_condition=True)
    for i, spring in enumerate(scene.spring):
        yield SceneExpression(("spring", i, "law", "effort"), spring.law.effort)
    for i, coupling in enumerate(scene.coupling):
        yield SceneExpression(("coupling", i, coupling.key), coupling.row)


def hinge_name_at(scene: SceneTables, place: Location) -> str:
    """Name of the hinge at a location; for a chain pattern, of the first member with it."""
    if place[0] == "chain":
        return scene.hinges.name(scene.hinges.starts[int(place[1])] + int(place[3]))
    return scene.hinge[int(place[1])].name


def used_types(scene: SceneTables) -> set[tuple[str, str]]:
    """Set of (kind, type) of all elements of a scene."""
    return {(kind, element.type) for kind, _, element in typed_tables(scene)}


def type_problems(
    scene: SceneTables, known: Mapping[tuple[str, str], ElementSpec]
) -> list[Problem]:
    """Problems of unknown types, and of elements that do not fit their definition."""
    problems: list[Problem] = []
    builtin = dict(_KINDS_BY_TABLE.values())
    for kind, location, element in typed_tables(scene):
        if element.type in builtin[kind]:
            continue
        spec = known.get((kind, element.type))
        if spec is None:
            user_types = [name for k, name in known if k == kind]
            synonym_of = _hinge_type_for(element.type) if kind == "hinge" else None
            hint = did_you_mean(element.type, [*builtin[kind], *user_types])
            hint = f'; use "{synonym_of}"' if synonym_of else hint
            problems.append(((*location, "type"), f'unknown {kind} type "{element.type}"{hint}'))
        else:
            problems += _element_problems(scene, location, element, spec)
    return problems


def apply_definitions(
    scene: SceneTables, known: Mapping[tuple[str, str], ElementSpec]
) -> list[Problem]:
    """Store the facts of user-defined types in their hinges, and resolve their defaults.

    Returns the problems found.
    """
    problems: list[Problem] = []
    for kind, location, element in typed_tables(scene):
        spec = known.get((kind, element.type))
        if spec is not None and spec.facts is not None:
            vars(element)["facts"] = spec.facts
            try:
                vars(element).update(resolve_defaults_for(element, spec.facts))
            except ValidationProblems as refused:
                problems += (((*location, *inner), text) for inner, text in refused.problems)
    return problems


def copy_definitions(scene: SceneTables, other: SceneTables) -> None:
    """Copy the facts of user-defined hinge types from a scene with the same elements."""
    pairs = zip(typed_tables(scene), typed_tables(other), strict=True)
    for (kind, _, target), (_, _, source) in pairs:
        if kind == "hinge" and source.builtin is None and source.facts is not None:
            vars(target)["facts"] = source.facts


def problems_of_type(scene: SceneTables, spec: ElementSpec) -> list[Problem]:
    """Problems of the elements of one user-defined type."""
    return [
        problem
        for kind, location, element in typed_tables(scene)
        if kind == spec.kind and element.type == spec.name
        for problem in _element_problems(scene, location, element, spec)
    ]


def _element_problems(
    scene: SceneTables, place: Location, element: Any, spec: ElementSpec
) -> Iterator[Problem]:
    yield from _parameter_problems(place, element.parameters, spec)
    if spec.kind == "hinge":
        for inner, text in unexpected_keys(element, spec.facts):
            yield (*place, *inner), text
        yield from _length_problems(place, element, spec)
        yield from _index_problems(scene, element, spec)


def _parameter_problems(
    place: Location, given: Mapping[str, float], spec: ElementSpec
) -> Iterator[Problem]:
    type_parameters = spec.parameters if spec.facts is None else spec.facts.extra_parameters()
    parameters_by_name = {p.name: p for p in type_parameters}
    for name, value in given.items():
        location, one = (*place, "parameters", name), parameters_by_name.get(name)
        if one is None:
            hint = did_you_mean(name, parameters_by_name)
            yield location, f'{spec.name} has no parameter "{name}"{hint}'
        elif one.minimum is not None and value < one.minimum:
            yield location, f"expected {one.minimum:g} {one.unit} or more, found {value:g}"
        elif one.maximum is not None and value > one.maximum:
            yield location, f"expected {one.maximum:g} {one.unit} or less, found {value:g}"
    for one in type_parameters:
        if one.default is None and one.name not in given:
            unit = f" in {one.unit}" if one.unit else ""
            meaning = f" ({one.description})" if one.description else ""
            yield (*place, "parameters", one.name), f"missing; expected a number{unit}{meaning}"


def _length_problems(place: Location, hinge: HingeTable, spec: ElementSpec) -> Iterator[Problem]:
    """Problems of the lengths of initial values, drive and law."""
    checked_lists: list[tuple[Location, Any, int]] = []
    if hinge.initial is not None:
        checked_lists.append((("initial", "q"), hinge.initial.q, len(spec.coordinates)))
        checked_lists.append((("initial", "u"), hinge.initial.u, len(spec.speeds)))
    if hinge.drive is not None:
        checked_lists.append((("drive",), hinge.drive, len(spec.coordinates)))
        if len(spec.coordinates) != len(spec.speeds):
            yield (
                (*place, "drive"),
                f"{spec.name} cannot be driven: it has {len(spec.coordinates)} coordinates and "
                f"{len(spec.speeds)} speeds",
            )
    for key in type(hinge.law).model_fields:
        values = getattr(hinge.law, key)
        if len(values) > 1 or (values and not spec.speeds):
            checked_lists.append((("law", key), values, len(spec.speeds)))
        elif values and len({speed.unit for speed in spec.speeds}) > 1:
            units = ", ".join(effort_unit(speed.unit) for speed in spec.speeds)
            yield (
                (*place, "law", key),
                f"one number cannot be used for efforts in {units}; "
                f"give a list with {len(spec.speeds)} entries",
            )
    for inner_location, values, count in checked_lists:
        if values is not None and len(values) != count:
            yield (
                (*place, *inner_location),
                f"expected {count} entries for {spec.name}, found {len(values)}",
            )


def _index_problems(scene: SceneTables, hinge: HingeTable, spec: ElementSpec) -> Iterator[Problem]:
    """Problems of indices of a hinge's coordinates in all expressions of the scene."""
    for one in scene_expressions(scene):
        for name in one.expression.names:
            if name.quantity not in ("q", "u"):
                continue
            named_table = one.own if len(name.parts) == 1 else _hinge_table(scene, name.hinge)
            if named_table is not hinge:
                continue
            entries = spec.coordinates if name.quantity == "q" else spec.speeds
            hinge_name = name.hinge or hinge_name_at(scene, one.location)
            message = index_problem(name, hinge_name, len(entries))
            if message is not None:
                yield one.location, message


def _hinge_table(scene: SceneTables, name: str) -> HingeTable | None:
    """Table of the hinge with this name, or None."""
    index = scene.hinges.find(name)
    if index is None or index < len(scene.hinge):
        return None if index is None else scene.hinge[index]
    chain, k = scene.hinges.member(index)
    return scene.chain[chain].hinge_of(k)


# --- synonyms of hinge types ----------------------------------------------------------------------

_HINGE_TYPES_BY_SYNONYM = {
    "revolute": "pin", "continuous": "pin", "hinge": "pin", "pivot": "pin", "rotational": "pin",
    "slider": "prismatic", "slide": "prismatic", "translational": "prismatic",
    "spherical": "ball", "socket": "ball", "ballandsocket": "ball",
    "weld": "fixed", "rigid": "fixed", "clamp": "fixed", "clamped": "fixed",
    "floating": "free", "freejoint": "free", "freeflyer": "free",
    "cardan": "universal", "hooke": "universal", "helical": "screw", "bushing": "elastic",
}  # fmt: skip


def _hinge_type_for(word: str) -> str | None:
    """Hinge type for a synonym used by other programs; None for an unknown one."""
    normalised = re.sub("[^a-z]", "", word.lower())
    return _HINGE_TYPES_BY_SYNONYM.get(normalised) or _HINGE_TYPES_BY_SYNONYM.get(
        re.sub("(joint|hinge)$", "", normalised)
    )
