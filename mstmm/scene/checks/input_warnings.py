"""Warnings about accepted but doubtful input of a scene: inertias, proportions, angles, loads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ...numerics.rotations import Vector, cross, norm, product, rotate, transpose
from ...risk import Risk
from ..tables.chain import HINGE_SUFFIX
from ..tables.hinge_frames import initial_motion_axes
from ..tables.loads import MASS_CENTER
from ..validators.rotations_and_inertia import triangle_message
from ..validators.scalars_and_vectors import GROUND, split_reference
from . import flexible_bodies, inputs
from .consistency import body_tables

if TYPE_CHECKING:
    from ..tables.beam import Beam
    from ..tables.body import Body
    from ..tables.elastic import Elastic
    from ..tables.hinge import Hinge, HingeTable
    from ..tables.loads import Load
    from ..tables.scene_tables import SceneTables


def risks(scene: SceneTables) -> tuple[Risk, ...]:
    """Warnings about accepted but doubtful input.

    They concern impossible inertias, angles that look like degrees, beams outside their theory,
    unused inputs, and loads without effect.
    """
    return (
        *_inertia_warnings(scene),
        *_proportion_warnings(scene),
        *_degree_warnings(scene),
        *flexible_bodies.flexible_warnings(scene),
        *inputs.unused_input_warnings(scene),
        *idle_load_warnings(scene),
    )


def _inertia_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about impossible inertias, and about negative moments that are rounding."""
    rounded_moments = []
    for _, name, body in body_tables(scene):
        message = triangle_message(body.inertia_matrix)
        if message is not None:
            means = f"{name}: inertia: {message}; accepted because of allow_unphysical_inertia"
            remedy = "correct it unless it does not describe a real body"
            yield Risk("inertia", name, means, remedy, invalidates=False, seen_before_run=True)
        rounded_moments += [(name, x) for k, x in enumerate(body.inertia[:3])
                  if x < 0 and body.inertia_matrix[k][k] == 0]  # fmt: skip
    if rounded_moments:
        name, entry = rounded_moments[0]
        more_text = f" (and {len(rounded_moments) - 1} more)" if len(rounded_moments) > 1 else ""
        means = f"{name}: inertia: {entry:.3g} kg m^2 is rounding and is treated as zero{more_text}"
        yield Risk(
            "inertia", name, means, "write 0", entry, 0.0, "kg*m2", invalidates=False,
            seen_before_run=True,
        )  # fmt: skip


#: Extent in m above which a rigid body below this mass per extent in kg/m suggests wrong units.
_MIN_LONG_EXTENT, _MAX_LIGHT_MASS_PER_LENGTH = 20.0, 2e-3


def _proportion_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about rigid bodies so long and light that their lengths are probably in mm."""
    for _, name, body in body_tables(scene):
        points = [body.center_of_mass, *(end.position for end in body.ends.values())]
        extent = max(math.dist((0.0, 0.0, 0.0), location) for location in points)
        if (
            body.type == "rigid"
            and extent >= _MIN_LONG_EXTENT
            and 0 < body.mass <= _MAX_LIGHT_MASS_PER_LENGTH * extent
        ):
            yield Risk(
                "proportions", name,
                f"{name}: it extends over {extent:g} m with a mass of {body.mass:g} kg",
                "lengths are in m and masses in kg; convert other units", body.mass / extent,
                _MAX_LIGHT_MASS_PER_LENGTH, "kg/m", invalidates=False, seen_before_run=True,
            )  # fmt: skip


# --- angles in degrees ----------------------------------------------------------------------------


def _degree_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about angles above one turn, which are usually meant in degrees."""
    for hinge in scene.hinge:
        yield from _hinge_warnings(f'hinge "{hinge.name}"', hinge)
    for chain in scene.chain:
        for k, table in enumerate(chain.hinge):
            yield from _hinge_warnings(f'hinge {k + 1} of chain "{chain.name}"', table)
        yield from _angle_warnings(f'chain "{chain.name}": orientation', chain.orientation or ())
    for bushing in scene.bushing:
        yield from _angle_warnings(f'bushing "{bushing.name}": orientation', bushing.orientation)
        yield from _angle_warnings(f'bushing "{bushing.name}": rest', bushing.rest.orientation)
    owners: tuple[Body | Beam | Elastic, ...] = (*scene.body, *scene.beam, *scene.elastic)
    for body in owners:
        for name, end in body.ends.items():
            yield from _angle_warnings(f'"{body.name}.{name}": orientation', end.orientation)


def _hinge_warnings(name: str, hinge: HingeTable) -> Iterator[Risk]:
    yield from _angle_warnings(f"{name}: orientation", hinge.orientation)
    facts = hinge.facts
    if facts is None or facts.quaternion is not None:
        return
    start = () if hinge.initial is None else hinge.initial.q or ()
    for k, coordinate in enumerate(facts.coordinates):
        if coordinate.unit != "rad":
            continue
        yield from _angle_warnings(f"{name}: initial q", start, k)
        yield from _angle_warnings(f"{name}: rest", hinge.law.rest, k)
        for limits in hinge.law.limits[k : k + 1]:
            yield from _angle_warnings(f"{name}: lower limit", (limits.lower or 0.0,))
            yield from _angle_warnings(f"{name}: upper limit", (limits.upper or 0.0,))


def _angle_warnings(what: str, values: tuple[float, ...], at: int | None = None) -> Iterator[Risk]:
    selected = values if at is None else values[at : at + 1]
    for value in selected:
        if abs(value) > 2 * math.pi * (1 + 1e-9):
            yield Risk(
                "degrees", what.partition(": ")[0],
                f"{what}: {value:.6g} rad is {abs(value) / (2 * math.pi):.3g} turns",
                f"if degrees were meant, write {math.radians(value):.6g}", abs(value), 2 * math.pi,
                "rad", invalidates=False, seen_before_run=True,
            )  # fmt: skip


# --- loads without effect -------------------------------------------------------------------------


#: Distances below this part of a body's own are rounding.
_MAX_RELATIVE_ROUNDING = 1e-12
#: Most bodies between a load and the ground that are checked.
_MAX_DEPTH = 20


def idle_load_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about loads whose point is at rest in every motion of the body."""
    if not scene.load:
        return
    inboard_hinges: dict[str, list[Hinge]] = {}
    for hinge in scene.hinge:
        inboard_hinges.setdefault(hinge.outboard_body, []).append(hinge)
    for load in scene.load:
        pivot = _find_pivot(load, scene, inboard_hinges)
        if pivot is not None:
            body = split_reference(load.on)[0]
            yield Risk(
                "idle-load", f'load "{load.name}"',
                f'load "{load.name}" acts at the pivot of "{body}" (hinge "{pivot.name}"): its '
                "force has no effect",
                f'apply it at an end of the body, or use at = "{MASS_CENTER}"',
                invalidates=False, seen_before_run=True,
            )  # fmt: skip


def _find_pivot(load: Load, scene: SceneTables, held: Mapping[str, list[Hinge]]) -> Hinge | None:
    """Hinge that keeps the point of a load at rest; None where it moves, or nothing moves."""
    name, end = split_reference(load.on)
    bodies, hinges = scene.bodies.by_name, scene.hinges.by_name
    has_force = any(not entry.is_zero for entry in load.force)
    if not has_force or any(not entry.is_zero for entry in load.moment) or name not in bodies:
        return None
    body, pivot = bodies[name], None
    point = body.center_of_mass if load.at is not None else body.end_position(end)
    for _ in range(_MAX_DEPTH):
        member = f"{name}.{HINGE_SUFFIX}"
        holders = [hinges[member]] if member in hinges else held.get(name, [])
        if bodies[name].type != "rigid" or len(holders) != 1:
            return None
        hinge = holders[0]
        if not _keeps_point(hinge, bodies[name], point):
            return None
        if not hinge.is_weld:
            pivot = pivot or hinge
        if hinge.inboard_body == GROUND:
            return pivot
        if hinge.inboard_body not in bodies:
            return None
        point = _position_in_inboard_body(hinge, bodies, point)
        name = hinge.inboard_body
    return None


def _vector_from_hinge(hinge: Hinge, body: Body, point: Vector) -> Vector:
    """Vector from the hinge to a point of the outboard body, in the axes of its end."""
    end = split_reference(hinge.outboard)[1]
    (a, b, c), (x, y, z) = point, body.end_position(end)
    return rotate(transpose(body.end_rotation(end)), (a - x, b - y, c - z))


def _keeps_point(hinge: Hinge, body: Body, point: Vector) -> bool:
    """Whether a hinge only rotates its outboard body about a given point."""
    facts, motions = hinge.facts, initial_motion_axes(hinge)
    if facts is None or motions is None or hinge.is_released:
        return False
    arm = _vector_from_hinge(hinge, body, point)
    size = max(map(abs, (*point, *body.center_of_mass)), default=0.0)
    rounding = _MAX_RELATIVE_ROUNDING * (size or 1.0)
    if len(motions) > 1 and norm(arm) > rounding:
        return False
    only_rotates = all(varies.startswith("000") for varies in facts.varies)
    return only_rotates and all(norm(cross(turn, arm)) <= rounding for _, turn in motions)


def _position_in_inboard_body(hinge: Hinge, bodies: Mapping[str, Body], point: Vector) -> Vector:
    """Position in the inboard body of a point that the hinge does not move."""
    inboard, end = bodies[hinge.inboard_body], split_reference(hinge.inboard)[1]
    arm = _vector_from_hinge(hinge, bodies[hinge.outboard_body], point)
    offset = rotate(product(inboard.end_rotation(end), hinge.rotation), arm)
    a, b, c = inboard.end_position(end)
    x, y, z = offset
    return (a + x, b + y, c + z)
