"""Welded rigid bodies as one: their mass, mass centre and inertia together, their ends kept.

A body that is welded to another one becomes part of it.  Its origin and its ends live on as ends of
that one, under names that tell where they come from: "arm.tip" on "hub" becomes "hub.arm_tip".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mstmm.arrays import Array
from mstmm.expression.expression import Expression
from mstmm.numbers.rotations import IDENTITY, Matrix, rows, to_quaternion
from mstmm.scene import Body, End, Hinge, Scene, split
from mstmm.scene.rules.values import GROUND
from mstmm.scene.tables.rigid import rigid_beam

from ..chart.models import with_tables
from .choice import RIGID

#: Keys of the tables that refer to a body or to one of its ends.
REFERENCES = {
    "hinge": ("inboard", "outboard"), "chain": ("inboard",), "load": ("on",),
    "spring": ("from_", "to"),
}  # fmt: skip


@dataclass(frozen=True)
class Merged:
    """A scene with fewer bodies.

    Attributes:
        scene: with welded bodies as one.
        names: "arm" and "arm.tip" of the former scene -> "hub.arm", "hub.arm_tip".
        into: body that is gone -> body that it is part of.
    """

    scene: Scene
    names: Mapping[str, str]
    into: Mapping[str, str]

    @property
    def words(self) -> tuple[str, ...]:
        """A sentence for every body that others became part of."""
        parts: dict[str, list[str]] = {}
        for body, whole in self.into.items():
            parts.setdefault(whole, []).append(body)
        return tuple(
            f'body "{whole}": one with {", ".join(gone)}, which are welded to it; '
            + ", ".join(
                f"{old} is {new} now" for old, new in self.names.items() if split(old)[0] in gone
            )
            for whole, gone in parts.items()
        )


def merged(scene: Scene) -> Merged | None:
    """The scene with every weld between rigid bodies gone; None where there is none."""
    found = Merged(_with_rigid_beams(scene), {}, {})
    spoken = set(_spoken_of(scene))
    while True:
        bodies = {body.name: body for body in found.scene.body}
        weld = next((h for h in found.scene.hinge if _goes(h, bodies, found.scene, spoken)), None)
        if weld is None:
            return found if found.into else None
        found = _without(found, weld, bodies)


# --- what may go ----------------------------------------------------------------------------------


def _with_rigid_beams(scene: Scene) -> Scene:
    """Beams that do not deform, welded at one end at least, as bodies."""
    spread = {load.on for load in scene.load if load.force_per_length is not None}
    welded = {
        split(end)[0] for h in scene.hinge if h.is_weld for end in (h.inboard, h.outboard)
    }  # fmt: skip
    stiff = [
        beam for beam in scene.beam
        if beam.model == RIGID and beam.name in welded and beam.name not in spread
    ]  # fmt: skip
    names = {beam.name for beam in stiff}
    return with_tables(
        scene,
        body=(*scene.body, *map(_body_of, stiff)),
        beam=tuple(beam for beam in scene.beam if beam.name not in names),
    )


def _body_of(beam: Any) -> Body:
    made = rigid_beam(beam)
    ends = {name: End(position=end.position, orientation=end.orientation)
            for name, end in made.ends.items()}  # fmt: skip
    return Body(
        name=beam.name, mass=made.mass, center_of_mass=made.center_of_mass, inertia=made.inertia,
        allow_unphysical_inertia=True, ends=ends,
    )  # fmt: skip


def _goes(weld: Hinge, bodies: Mapping[str, Body], scene: Scene, spoken: set[str]) -> bool:
    """Whether a hinge is a weld of two rigid bodies whose outboard one nothing speaks of."""
    if not weld.is_weld or weld.inboard_body == GROUND or weld.lets_go:
        return False
    pair = [bodies.get(weld.inboard_body), bodies.get(weld.outboard_body)]
    if any(body is None or body.type != RIGID for body in pair):
        return False
    released = any(event.hinge == weld.name for event in scene.event)
    own_axes = any(
        split(load.on)[0] == weld.outboard_body and load.axes != "inertial" for load in scene.load
    )
    return not (released or own_axes or {weld.name, weld.outboard_body} & spoken)


def _spoken_of(value: Any) -> Iterator[str]:
    """Names of bodies and hinges in expressions, and of bodies whose axes loads have."""
    if isinstance(value, Expression):
        yield from (part for name in value.names if name.parts[1:] for part in name.parts)
    elif isinstance(value, (list, tuple)):
        for entry in value:
            yield from _spoken_of(entry)
    elif isinstance(value, dict):
        for entry in value.values():
            yield from _spoken_of(entry)
    elif hasattr(type(value), "model_fields"):
        if hasattr(value, "axes"):
            yield str(value.axes)
        for key in type(value).model_fields:
            yield from _spoken_of(getattr(value, key))


# --- one weld -------------------------------------------------------------------------------------


def _without(found: Merged, weld: Hinge, bodies: Mapping[str, Body]) -> Merged:
    """The scene in which the outboard body of a weld is part of the inboard one."""
    scene, whole, part = found.scene, bodies[weld.inboard_body], bodies[weld.outboard_body]
    turned, place = _pose(weld, whole, part)
    names = {part.name: _free_name(whole, part.name)}
    ends = {**whole.ends, names[part.name]: _end(turned, place)}
    for name, end in part.ends.items():
        own = f"{part.name}.{name}"
        names[own] = _free_name(whole, f"{part.name}_{name}")
        at = place + turned @ np.array(end.position)
        ends[names[own]] = _end(turned @ np.array(end.rotation), at)
    renamed = {old: f"{whole.name}.{new}" for old, new in names.items()}
    together = _together(whole, part, turned, place).model_copy(update={"ends": ends})
    kept = tuple(
        together if body.name == whole.name else body
        for body in scene.body
        if body.name != part.name
    )
    tables: dict[str, Any] = {
        table: tuple(with_names(one, keys, renamed) for one in getattr(scene, table))
        for table, keys in REFERENCES.items()
    }
    tables["hinge"] = tuple(one for one in tables["hinge"] if one.name != weld.name)
    former = {old: renamed.get(new, new) for old, new in found.names.items()}
    into = {
        gone: whole.name if target == part.name else target for gone, target in found.into.items()
    }
    return replace(
        found, scene=with_tables(scene, body=kept, **tables), names={**former, **renamed},
        into={**into, part.name: whole.name},
    )  # fmt: skip


def _pose(weld: Hinge, whole: Body, part: Body) -> tuple[Array, Array]:
    """Axes (3, 3) and origin (3,) of the outboard body in the inboard one's axes."""
    held = np.array(part.end_rotation(weld.outboard_end))
    turned = np.array(whole.end_rotation(weld.inboard_end)) @ np.array(weld.rotation) @ held.T
    at = np.array(whole.end_position(weld.inboard_end))
    return turned, at - turned @ np.array(part.end_position(weld.outboard_end))


def _together(whole: Body, part: Body, turned: Array, place: Array) -> Body:
    """Mass, mass centre and inertia of both, in the axes of the first (Steiner's theorem)."""
    mass = whole.mass + part.mass
    centers = [np.array(whole.center_of_mass), place + turned @ np.array(part.center_of_mass)]
    masses = [whole.mass, part.mass]
    inertias = [
        np.array(whole.inertia_matrix), turned @ np.array(part.inertia_matrix) @ turned.T
    ]  # fmt: skip
    middle = centers[0]
    if mass > 0:
        middle = (masses[0] * centers[0] + masses[1] * centers[1]) / mass
    total = np.zeros((3, 3))
    for m, center, inertia in zip(masses, centers, inertias, strict=True):
        away = center - middle
        total += inertia + m * (away @ away * np.eye(3) - np.outer(away, away))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = total.tolist()
    return whole.model_copy(
        update={
            "mass": mass, "center_of_mass": tuple(middle.tolist()),
            "inertia": (xx, yy, zz, xy, xz, yz),
            "allow_unphysical_inertia":
                whole.allow_unphysical_inertia or part.allow_unphysical_inertia,
        }
    )  # fmt: skip


def _end(turned: Array, place: Array) -> End:
    matrix: Matrix = rows(turned.tolist())
    straight = matrix == IDENTITY
    orientation = (0.0, 0.0, 0.0) if straight else to_quaternion(matrix)
    return End(position=tuple(place.tolist()), orientation=orientation)


def _free_name(whole: Body, name: str) -> str:
    while name in whole.ends:
        name += "_"
    return name


def with_names(element: Any, keys: tuple[str, ...], names: Mapping[str, str]) -> Any:
    """An element of a table whose references have other names."""
    update = {key: names[at] for key in keys if (at := getattr(element, key)) in names}
    return element.model_copy(update=update) if update else element
