"""Checks across the elements of a scene: references, names in expressions, types, physics."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain, islice
from typing import TYPE_CHECKING

from . import topology
from .expression import Expression
from .scene_errors import MAX_PROBLEMS, TABLES, Problem, near
from .scene_names import Scope, problem_with
from .scene_physics import triangle_excess
from .scene_rules import GROUND, Location, split

if TYPE_CHECKING:
    from .scene import Scene


def problems(scene: Scene) -> list[Problem]:
    """Everything in which the elements of a scene do not fit each other."""
    if not scene.body:
        return [(("body",), "a scene needs at least one body; add a [[body]]")]
    found = _first(_duplicates(scene), _references(scene), _inertias(scene))
    return found or _first(_expressions(scene), topology.problems(scene))


def _first(*findings: Iterable[Problem]) -> list[Problem]:
    return list(islice(chain(*findings), MAX_PROBLEMS))


def _duplicates(scene: Scene) -> Iterator[Problem]:
    for table in TABLES:
        seen: dict[str, int] = {}
        for i, element in enumerate(getattr(scene, table)):
            first = seen.setdefault(element.name, i)
            if first != i:
                yield (
                    (table, i, "name"),
                    f'"{element.name}" is also the name of {table} number {first + 1}; rename one',
                )


def _references(scene: Scene) -> Iterator[Problem]:
    ends = {body.name: body.ends for body in scene.body}
    for i, hinge in enumerate(scene.hinge):
        yield from _end(hinge.inboard, ends, ("hinge", i, "inboard"))
        yield from _end(hinge.outboard, ends, ("hinge", i, "outboard"))
    for i, load in enumerate(scene.load):
        yield from _end(load.on, ends, ("load", i, "on"))
        yield from _axes(scene, i, ends)
    for i, spring in enumerate(scene.spring):
        yield from _end(spring.from_, ends, ("spring", i, "from"))
        yield from _end(spring.to, ends, ("spring", i, "to"))
    hinges = {hinge.name: hinge for hinge in scene.hinge}
    for i, event in enumerate(scene.event):
        if event.hinge is None:
            continue
        place: Location = ("event", i, "hinge")
        if event.hinge not in hinges:
            yield place, f'there is no hinge "{event.hinge}"{near(event.hinge, hinges)}'
        elif hinges[event.hinge].type != "fixed" and hinges[event.hinge].drive is None:
            yield place, f'"{event.hinge}" is neither driven nor fixed, so it cannot be released'


def _end(
    reference: str, ends: Mapping[str, Mapping[str, object]], place: Location
) -> Iterator[Problem]:
    """Is there such a body, and has it such an end?"""
    body, at = split(reference)
    if body == GROUND:
        return
    if body not in ends:
        yield place, f'there is no body "{body}"{near(body, ends)}'
    elif at and at not in ends[body]:
        way_out = near(at, ends[body]) if ends[body] else f"; give it ends = {{ {at} = [x, y, z] }}"
        yield place, f'body "{body}" has no end "{at}"{way_out}'


def _axes(scene: Scene, i: int, bodies: Mapping[str, object]) -> Iterator[Problem]:
    load = scene.load[i]
    if load.axes in ("inertial", "body"):
        if load.axes in bodies and not (load.axes == "body" == split(load.on)[0]):
            yield (
                ("load", i, "axes"),
                f'"{load.axes}" could also mean the body of this name; rename that body',
            )
    elif load.axes not in bodies:
        options = ["inertial", "body", *bodies]
        yield ("load", i, "axes"), f'there is no body "{load.axes}"{near(load.axes, options)}'


def _inertias(scene: Scene) -> Iterator[Problem]:
    for i, body in enumerate(scene.body):
        if scene.allow_unphysical_inertia or body.allow_unphysical_inertia:
            continue
        excess = triangle_excess(body.inertia_matrix)
        if excess is not None:
            yield (
                ("body", i, "inertia"),
                f"{excess}, so no body has this inertia; correct it, or accept it with "
                "allow_unphysical_inertia = true",
            )


def warnings(scene: Scene) -> tuple[str, ...]:
    """What is accepted but worth knowing: inertias that no body can have."""
    found = []
    for body in scene.body:
        excess = triangle_excess(body.inertia_matrix)
        if excess is not None:
            found.append(f'body "{body.name}": inertia: {excess}; accepted as asked')
    return tuple(found)


# --- names in expressions -------------------------------------------------------------------------


def _expressions(scene: Scene) -> Iterator[Problem]:
    hinges = {hinge.name: hinge for hinge in scene.hinge}
    ends = {body.name: frozenset(body.ends) for body in scene.body}
    anywhere = Scope(hinges, ends)
    in_events = Scope(hinges, ends, positions=True)
    for i, hinge in enumerate(scene.hinge):
        own = Scope(hinges, ends, own=hinge)
        for k, effort in enumerate(hinge.law.effort):
            yield from _names(effort, own, ("hinge", i, "law", "effort", k))
        if hinge.release is not None:
            released = Scope(hinges, ends, own=hinge, positions=True)
            yield from _names(hinge.release, released, ("hinge", i, "release"))
    for i, load in enumerate(scene.load):
        for key in ("force", "moment"):
            for k, entry in enumerate(getattr(load, key)):
                yield from _names(entry, anywhere, ("load", i, key, k))
    for i, event in enumerate(scene.event):
        yield from _names(event.when, in_events, ("event", i, "when"))
    for i, spring in enumerate(scene.spring):
        yield from _names(
            spring.law.effort, Scope(hinges, ends, spring=True), ("spring", i, "law", "effort")
        )


def _names(expression: Expression, scope: Scope, place: Location) -> Iterator[Problem]:
    for name in expression.names:
        message = problem_with(name, scope)
        if message is not None:
            context = "" if expression.text == name.text else f" (in {expression.text[:80]!r})"
            yield place, message + context
