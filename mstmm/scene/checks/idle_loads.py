"""Warnings about forces that act at a pivot and therefore have no effect."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ...numerics.rotations import Vector, cross, norm, product, rotate, transpose
from ...risk import Risk
from ..tables.chain import HINGE_SUFFIX
from ..tables.hinge_frames import initial_motion_axes
from ..tables.loads import MASS_CENTER
from ..validators.scalars_and_vectors import GROUND, split_reference

if TYPE_CHECKING:
    from ..tables.body import Body
    from ..tables.hinge import Hinge
    from ..tables.loads import Load
    from ..tables.scene_tables import SceneTables

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
