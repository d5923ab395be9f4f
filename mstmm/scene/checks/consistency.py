"""Consistency checks across the elements of a scene: references, names, types, physics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain as one_after_another
from itertools import islice
from typing import TYPE_CHECKING

from ...expression.parser import context_of_name
from ..tables.closures import CURVE
from ..validators.rotations_and_inertia import negative_moment_message, triangle_message
from ..validators.scalars_and_vectors import GROUND, Location, split_reference
from ..validators.validation_messages import MAX_PROBLEMS, TABLES, Problem, did_you_mean
from . import closures, flexible_bodies, inputs, topology
from .expression_names import Scope, modal_names, name_problem
from .user_types import hinge_name_at, scene_expressions

if TYPE_CHECKING:
    from ..tables.body import BodyTable
    from ..tables.chain import Bodies
    from ..tables.scene_tables import SceneTables


def problems(scene: SceneTables) -> list[Problem]:
    """Problems of consistency between the elements of a scene."""
    if not (scene.body or scene.chain or scene.beam or scene.elastic):
        return [(("body",), "a scene needs at least one body; add a [[body]]")]
    first_findings = _first_problems(
        _duplicate_problems(scene),
        _reference_problems(scene),
        _inertia_problems(scene),
        inputs.problems(scene),
        flexible_bodies.problems(scene),
        _external_name_problems(scene),
    )
    return first_findings or _first_problems(
        _expression_problems(scene),
        inputs.drive_problems(scene),
        closures.constraint_problems(scene),
        closures.coupling_problems(scene),
        _tree_problems(scene),
        flexible_bodies.spin_problems(scene),
    )


def _tree_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of the spanning tree, each at the table that the body comes from."""
    first_indices = (("body", 0), ("beam", len(scene.body)),
              ("elastic", len(scene.body) + len(scene.beam)))  # fmt: skip
    for (table, index, *inner_location), message in topology.problems(scene.skeleton):
        if table == "body" and isinstance(index, int):
            table, first_index = next(
                table_start for table_start in reversed(first_indices) if index >= table_start[1]
            )
            index -= first_index
        yield (table, index, *inner_location), message


def _first_problems(*findings: Iterable[Problem]) -> list[Problem]:
    return list(islice(one_after_another(*findings), MAX_PROBLEMS))


def _duplicate_problems(scene: SceneTables) -> Iterator[Problem]:
    for table in TABLES:
        first_indices: dict[str, int] = {}
        for i, element in enumerate(getattr(scene, table)):
            first_index = first_indices.setdefault(element.name, i)
            if first_index != i:
                owner = f"{table} number {first_index + 1}"
                yield (table, i, "name"), _shared_name_message(element.name, owner)
    labels_by_name: dict[str, str] = {}
    for table in ("body", "hinge", "beam", "elastic", "chain", "bushing", "constraint", "coupling"):
        label = _TABLE_LABELS.get(table, f"a {table}")
        for i, element in enumerate(getattr(scene, table)):
            first_label = labels_by_name.setdefault(element.name, label)
            if first_label != label and {table, first_label} not in _SHARED_NAME_TABLES:
                yield (table, i, "name"), _shared_name_message(element.name, first_label)


def _shared_name_message(name: str, owner: str) -> str:
    return f'"{name}" is also the name of {owner}; rename one'


#: Name of an element of a table in messages.
_TABLE_LABELS = {"elastic": "an elastic body"}
#: A body and a hinge may have the same name: references to them are never ambiguous.
_SHARED_NAME_TABLES = ({"hinge", "a body"},)


def _reference_problems(scene: SceneTables) -> Iterator[Problem]:
    bodies = scene.skeleton.bodies
    for i, hinge in enumerate(scene.hinge):
        yield from _end_problems(hinge.inboard, scene, ("hinge", i, "inboard"))
        yield from _end_problems(hinge.outboard, scene, ("hinge", i, "outboard"))
        if bodies.place(hinge.outboard_body) is not None:
            yield (
                ("hinge", i, "outboard"),
                f'"{hinge.outboard_body}" already has an inboard hinge in its chain; '
                "use it as inboard body of this hinge",
            )
    for i, chain in enumerate(scene.chain):
        yield from _end_problems(chain.inboard, scene, ("chain", i, "inboard"))
    for i, load in enumerate(scene.load):
        yield from _end_problems(load.on, scene, ("load", i, "on"))
        if load.at is not None:
            yield from _mass_center_problems(split_reference(load.on)[0], scene, ("load", i, "at"))
        yield from _axes_problems(scene, i)
    for i, shape in enumerate(scene.shape):
        yield from _end_problems(shape.on, scene, ("shape", i, "on"))
    for table in ("spring", "bushing", "constraint"):
        for i, element in enumerate(getattr(scene, table)):
            yield from _end_problems(element.from_, scene, (table, i, "from"))
            yield from _end_problems(element.to, scene, (table, i, "to"))
    hinges = {hinge.name: hinge for hinge in scene.hinge}
    for i, event in enumerate(scene.event):
        if event.hinge is None:
            continue
        location: Location = ("event", i, "hinge")
        if event.hinge not in hinges:
            yield location, f'there is no hinge "{event.hinge}"{did_you_mean(event.hinge, hinges)}'
        elif not hinges[event.hinge].is_weld and hinges[event.hinge].drive is None:
            yield location, f'"{event.hinge}" cannot be released: it is neither driven nor fixed'


def _end_problems(reference: str, scene: SceneTables, place: Location) -> Iterator[Problem]:
    """Problems of a reference: no such body, or no such end."""
    body, end = split_reference(reference)
    if body == GROUND:
        return
    bodies = scene.skeleton.bodies
    ends = bodies.ends(body)
    if ends is None:
        yield place, bodies.missing(body)
    elif end and end not in ends:
        remedy = did_you_mean(end, ends) if ends else f"; give it ends = {{ {end} = [x, y, z] }}"
        yield place, f'body "{body}" has no end "{end}"{remedy}'
    elif not end and body in {elastic.name for elastic in scene.elastic}:
        remedy = f'write "{body}.{next(iter(ends))}"' if ends else "give it ends"
        yield place, f'"{body}" is an elastic body, which connects only at its ends; {remedy}'


def _mass_center_problems(body: str, scene: SceneTables, place: Location) -> Iterator[Problem]:
    """Problems of a load at the mass centre of a body that is not rigid."""
    flexible_names = {flexible_body.name for flexible_body in (*scene.beam, *scene.elastic)}
    bodies = scene.skeleton.bodies
    number = bodies.find(body)
    if body in flexible_names or (number is not None and bodies[number].type != "rigid"):
        yield place, f'"{body}" is not rigid and has no fixed mass centre; give an end'


def _axes_problems(scene: SceneTables, i: int) -> Iterator[Problem]:
    load = scene.load[i]
    bodies = scene.skeleton.bodies
    is_body = bodies.find(load.axes) is not None
    if load.axes in ("inertial", "body"):
        if is_body and not (load.axes == "body" == split_reference(load.on)[0]):
            text = f'"{load.axes}" is ambiguous: a body has this name; rename the body'
            yield ("load", i, "axes"), text
    elif not is_body:
        options = ["inertial", "body", *(body.name for body in scene.skeleton.body)]
        hint = did_you_mean(load.axes, options)
        yield ("load", i, "axes"), f'there is no body "{load.axes}"{hint}'


def body_tables(scene: SceneTables) -> Iterator[tuple[Location, str, BodyTable]]:
    """Yield (location, name for messages, table) of every body table, chain patterns included."""
    for i, body in enumerate(scene.body):
        yield ("body", i), f'body "{body.name}"', body
    for i, chain in enumerate(scene.chain):
        for k, table in enumerate(chain.body):
            yield ("chain", i, "body", k), f'body {k + 1} of chain "{chain.name}"', table


def _inertia_problems(scene: SceneTables) -> Iterator[Problem]:
    for location, _, body in body_tables(scene):
        if scene.allow_unphysical_inertia or body.allow_unphysical_inertia:
            continue
        text = negative_moment_message(body.inertia_matrix)
        if text is None and (text := triangle_message(body.inertia_matrix)) is not None:
            text = f"{text}, so no body has this inertia; correct it"
        if text is not None:
            remedy = "or accept it with allow_unphysical_inertia = true"
            yield (*location, "inertia"), f"{text}, {remedy}"


# --- names in expressions -------------------------------------------------------------------------


def _expression_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of names; those in couplings are checked with the couplings."""
    hinges = scene.hinges
    curves = {constraint.name for constraint in scene.constraint if constraint.type == CURVE}
    general_scope = Scope(
        hinges,
        scene.skeleton.bodies,
        flexible=modal_names(scene),
        inputs=scene.channels,
        curves=curves,
    )
    for location, expression, own, is_condition in scene_expressions(scene):
        if location[0] == "coupling" or not expression.names:
            continue
        hinge = None if own is None else hinges.by_name[hinge_name_at(scene, location)]
        scope = replace(
            general_scope, own=hinge, positions=is_condition, spring=location[0] == "spring"
        )
        for name in expression.names:
            message = name_problem(name, scope)
            if message is not None:
                yield location, message + context_of_name(expression.text, name)


# --- names of other programs ----------------------------------------------------------------------


def _external_name_problems(scene: SceneTables) -> Iterator[Problem]:
    """Problems of [names]: names for missing elements, and names that another element has."""
    bodies, hinges, modal = scene.skeleton.bodies, scene.hinges, modal_names(scene)
    for name, scene_name in scene.names.body.items():
        if scene_name.endswith(".") or not _is_body_or_end(scene_name, bodies):
            hint = did_you_mean(split_reference(scene_name)[0], (GROUND, *bodies.names()))
            yield ("names", "body", name), f'there is no body or end "{scene_name}"{hint}'
        elif name != scene_name and _is_body_or_end(name, bodies):
            yield ("names", "body", name), _used_name_message(name, "a body or an end")
    for name, scene_name in scene.names.hinge.items():
        if hinges.find(scene_name) is None:
            yield ("names", "hinge", name), hinges.missing(scene_name)
        elif name != scene_name and hinges.find(name) is not None:
            yield ("names", "hinge", name), _used_name_message(name, "a hinge")
        elif name in modal:
            yield ("names", "hinge", name), _used_name_message(name, "a flexible body")


def _used_name_message(name: str, what: str) -> str:
    return f'"{name}" is already the name of {what} of the scene; leave it out'


def _is_body_or_end(reference: str, bodies: Bodies) -> bool:
    body, end = split_reference(reference)
    ends = bodies.ends(body)
    return reference == GROUND or (ends is not None and (not end or end in ends))
