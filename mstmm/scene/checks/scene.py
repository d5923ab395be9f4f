"""Consistency checks across the elements of a scene: references, names, types, physics."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain as one_after_another
from itertools import islice
from typing import TYPE_CHECKING

from ...expression.expression import Expression
from ...expression.parser import around
from ...risk import Risk
from ..rules.inertia import negative_moment, triangle_excess
from ..rules.messages import MAX_PROBLEMS, TABLES, Problem, near
from ..rules.values import GROUND, Location, split
from ..tables.closures import CURVE
from . import constraints, couplings, idle_loads, inputs, outside_names, topology
from . import flexible as flexible_bodies
from .angles import notes
from .names import Scope, flexible, problem_with

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.body import BodyTable


def problems(scene: SceneTables) -> list[Problem]:
    """Problems of consistency between the elements of a scene."""
    if not (scene.body or scene.chain or scene.beam or scene.elastic):
        return [(("body",), "a scene needs at least one body; add a [[body]]")]
    found = _first(_duplicates(scene), _references(scene), _inertias(scene),
                   inputs.problems(scene), flexible_bodies.problems(scene),
                   outside_names.problems(scene))  # fmt: skip
    return found or _first(
        _expressions(scene), inputs.drives(scene), constraints.problems(scene),
        couplings.problems(scene), _tree(scene), flexible_bodies.spins(scene),
    )  # fmt: skip


def _tree(scene: SceneTables) -> Iterator[Problem]:
    """Problems of the spanning tree, each at the table that the body comes from."""
    firsts = (("body", 0), ("beam", len(scene.body)),
              ("elastic", len(scene.body) + len(scene.beam)))  # fmt: skip
    for (table, index, *inside), message in topology.problems(scene.skeleton):
        if table == "body" and isinstance(index, int):
            table, first = next(one for one in reversed(firsts) if index >= one[1])
            index -= first
        yield (table, index, *inside), message


def _first(*findings: Iterable[Problem]) -> list[Problem]:
    return list(islice(one_after_another(*findings), MAX_PROBLEMS))


def _duplicates(scene: SceneTables) -> Iterator[Problem]:
    for table in TABLES:
        seen: dict[str, int] = {}
        for i, element in enumerate(getattr(scene, table)):
            first = seen.setdefault(element.name, i)
            if first != i:
                yield (
                    (table, i, "name"),
                    f'"{element.name}" is also the name of {table} number {first + 1}; rename one',
                )
    taken: dict[str, str] = {}
    for table in ("body", "hinge", "beam", "elastic", "chain", "bushing", "constraint", "coupling"):
        word = _WORDS.get(table, f"a {table}")
        for i, element in enumerate(getattr(scene, table)):
            other = taken.setdefault(element.name, word)
            if other != word and {table, other} not in _APART:
                yield (
                    (table, i, "name"),
                    f'"{element.name}" is also the name of {other}; rename one',
                )


#: Name of an element of a table in messages.
_WORDS = {"elastic": "an elastic body"}
#: A body and a hinge may have the same name: references to them are never ambiguous.
_APART = ({"hinge", "a body"},)


def _references(scene: SceneTables) -> Iterator[Problem]:
    bodies = scene.skeleton.bodies
    for i, hinge in enumerate(scene.hinge):
        yield from _end(hinge.inboard, scene, ("hinge", i, "inboard"))
        yield from _end(hinge.outboard, scene, ("hinge", i, "outboard"))
        if bodies.place(hinge.outboard_body) is not None:
            yield (
                ("hinge", i, "outboard"),
                f'"{hinge.outboard_body}" already has an inboard hinge in its chain; '
                "use it as inboard body of this hinge",
            )
    for i, chain in enumerate(scene.chain):
        yield from _end(chain.inboard, scene, ("chain", i, "inboard"))
    for i, load in enumerate(scene.load):
        yield from _end(load.on, scene, ("load", i, "on"))
        if load.at is not None:
            yield from _mass_center(split(load.on)[0], scene, ("load", i, "at"))
        yield from _axes(scene, i)
    for i, shape in enumerate(scene.shape):
        yield from _end(shape.on, scene, ("shape", i, "on"))
    for table in ("spring", "bushing", "constraint"):
        for i, element in enumerate(getattr(scene, table)):
            yield from _end(element.from_, scene, (table, i, "from"))
            yield from _end(element.to, scene, (table, i, "to"))
    hinges = {hinge.name: hinge for hinge in scene.hinge}
    for i, event in enumerate(scene.event):
        if event.hinge is None:
            continue
        place: Location = ("event", i, "hinge")
        if event.hinge not in hinges:
            yield place, f'there is no hinge "{event.hinge}"{near(event.hinge, hinges)}'
        elif not hinges[event.hinge].is_weld and hinges[event.hinge].drive is None:
            yield place, f'"{event.hinge}" cannot be released: it is neither driven nor fixed'


def _end(reference: str, scene: SceneTables, place: Location) -> Iterator[Problem]:
    """Problems of a reference: no such body, or no such end."""
    body, at = split(reference)
    if body == GROUND:
        return
    bodies = scene.skeleton.bodies
    ends = bodies.ends(body)
    if ends is None:
        yield place, bodies.missing(body)
    elif at and at not in ends:
        way_out = near(at, ends) if ends else f"; give it ends = {{ {at} = [x, y, z] }}"
        yield place, f'body "{body}" has no end "{at}"{way_out}'
    elif not at and body in {elastic.name for elastic in scene.elastic}:
        way_out = f'write "{body}.{next(iter(ends))}"' if ends else "give it ends"
        yield place, f'"{body}" is an elastic body, which connects only at its ends; {way_out}'


def _mass_center(body: str, scene: SceneTables, place: Location) -> Iterator[Problem]:
    """Problems of a load at the mass centre of a body that is not rigid."""
    flexible_ones = {one.name for one in (*scene.beam, *scene.elastic)}
    bodies = scene.skeleton.bodies
    number = bodies.find(body)
    if body in flexible_ones or (number is not None and bodies[number].type != "rigid"):
        yield place, f'"{body}" is not rigid and has no fixed mass centre; give an end'


def _axes(scene: SceneTables, i: int) -> Iterator[Problem]:
    load = scene.load[i]
    bodies = scene.skeleton.bodies
    known = bodies.find(load.axes) is not None
    if load.axes in ("inertial", "body"):
        if known and not (load.axes == "body" == split(load.on)[0]):
            yield (
                ("load", i, "axes"),
                f'"{load.axes}" is ambiguous: a body has this name; rename the body',
            )
    elif not known:
        options = ["inertial", "body", *(body.name for body in scene.skeleton.body)]
        yield ("load", i, "axes"), f'there is no body "{load.axes}"{near(load.axes, options)}'


def _tables(scene: SceneTables) -> Iterator[tuple[Location, str, BodyTable]]:
    """Yield (location, name for messages, table) of every body table, chain patterns included."""
    for i, body in enumerate(scene.body):
        yield ("body", i), f'body "{body.name}"', body
    for i, chain in enumerate(scene.chain):
        for k, table in enumerate(chain.body):
            yield ("chain", i, "body", k), f'body {k + 1} of chain "{chain.name}"', table


def _inertias(scene: SceneTables) -> Iterator[Problem]:
    for place, _, body in _tables(scene):
        if scene.allow_unphysical_inertia or body.allow_unphysical_inertia:
            continue
        negative = negative_moment(body.inertia_matrix)
        excess = triangle_excess(body.inertia_matrix)
        if negative is not None:
            yield (*place, "inertia"), f"{negative}, or accept it with {_ACCEPTED}"
        elif excess is not None:
            yield (
                (*place, "inertia"),
                f"{excess}, so no body has this inertia; correct it, or accept it with {_ACCEPTED}",
            )


_ACCEPTED = "allow_unphysical_inertia = true"


def risks(scene: SceneTables) -> tuple[Risk, ...]:
    """Warnings about accepted but doubtful input.

    They concern impossible inertias, angles that look like degrees, beams outside their theory,
    unused inputs, and loads without effect.
    """
    found, dusty = [], []
    for _, name, body in _tables(scene):
        excess = triangle_excess(body.inertia_matrix)
        if excess is not None:
            means = f"{name}: inertia: {excess}; accepted because of allow_unphysical_inertia"
            remedy = "correct it unless it does not describe a real body"
            found.append(Risk("inertia", name, means, remedy, doubt=False, before=True))
        dusty += [(name, x) for k, x in enumerate(body.inertia[:3])
                  if x < 0 and body.inertia_matrix[k][k] == 0]  # fmt: skip
    if dusty:
        name, entry = dusty[0]
        more = f" (and {len(dusty) - 1} more)" if len(dusty) > 1 else ""
        means = f"{name}: inertia: {entry:.3g} kg m^2 is rounding and is treated as zero{more}"
        found.append(Risk(
            "inertia", name, means, "write 0", entry, 0.0, "kg*m2", doubt=False, before=True,
        ))  # fmt: skip
    return (
        *found, *_proportions(scene), *notes(scene), *flexible_bodies.risks(scene),
        *inputs.risks(scene), *idle_loads.risks(scene),
    )  # fmt: skip


#: Extent in m above which a rigid body below this mass per extent in kg/m suggests wrong units.
_LONG, _THIN = 20.0, 2e-3


def _proportions(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about rigid bodies so long and light that their lengths are probably in mm."""
    for _, name, body in _tables(scene):
        places = [body.center_of_mass, *(end.position for end in body.ends.values())]
        extent = max(math.dist((0.0, 0.0, 0.0), place) for place in places)
        if body.type == "rigid" and extent >= _LONG and 0 < body.mass <= _THIN * extent:
            yield Risk(
                "proportions", name,
                f"{name}: it extends over {extent:g} m with a mass of {body.mass:g} kg",
                "lengths are in m and masses in kg; convert other units",
                body.mass / extent, _THIN, "kg/m", doubt=False, before=True,
            )  # fmt: skip


# --- names in expressions -------------------------------------------------------------------------


def _expressions(scene: SceneTables) -> Iterator[Problem]:
    hinges, bodies = scene.hinges, scene.skeleton.bodies
    curves = {one.name for one in scene.constraint if one.type == CURVE}
    anywhere = Scope(hinges, bodies, flexible=flexible(scene), inputs=scene.channels, curves=curves)
    in_events = replace(anywhere, positions=True)
    for i, hinge in enumerate(scene.hinge):
        own = replace(anywhere, own=hinge)
        for k, effort in enumerate(hinge.law.effort):
            yield from _names(effort, own, ("hinge", i, "law", "effort", k))
        if hinge.release is not None:
            released = replace(in_events, own=hinge)
            yield from _names(hinge.release, released, ("hinge", i, "release"))
    for i, chain in enumerate(scene.chain):
        for j, table in enumerate(chain.hinge):
            member = replace(anywhere, own=hinges[hinges.starts[i] + j])
            for k, effort in enumerate(table.law.effort):
                yield from _names(effort, member, ("chain", i, "hinge", j, "law", "effort", k))
    for i, load in enumerate(scene.load):
        for key in ("force", "moment", "force_per_length"):
            for k, entry in enumerate(getattr(load, key) or ()):
                yield from _names(entry, anywhere, ("load", i, key, k))
    for i, event in enumerate(scene.event):
        yield from _names(event.when, in_events, ("event", i, "when"))
    for i, spring in enumerate(scene.spring):
        yield from _names(
            spring.law.effort, replace(anywhere, spring=True), ("spring", i, "law", "effort")
        )


def _names(expression: Expression, scope: Scope, place: Location) -> Iterator[Problem]:
    for name in expression.names:
        message = problem_with(name, scope)
        if message is not None:
            yield place, message + around(expression.text, name)
