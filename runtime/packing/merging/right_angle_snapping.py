"""Orientations that nearly are quarter turns, such as 1.57079632679: they become exact, so that
what is zero in their rotations needs no code and no time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from mstmm.numerics.rotations import Matrix, Vector, from_rpy
from mstmm.scene import Body, Hinge, Scene

from .simplification import TURNS, Simplification

#: Angle (rad) up to which an orientation is exact but for rounding.
_ROUNDING = 1e-15


def with_right_angles(scene: Scene, tolerance: float) -> tuple[Scene, list[Simplification]]:
    """The scene in which orientations of hinges and of ends of bodies that differ from quarter
    turns by up to `tolerance` (rad) are these, and a record for each; chains stay as they are."""
    told = list[Simplification]()
    hinges = tuple(_hinge(one, tolerance, told) for one in scene.hinge)
    bodies = tuple(_body(one, tolerance, told) for one in scene.body)
    if not told:
        return scene, told
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    return Scene.model_construct(**fields | {"hinge": hinges, "body": bodies}), told


def _hinge(hinge: Hinge, tolerance: float, told: list[Simplification]) -> Hinge:
    found = nearest_right_angles(hinge.rotation, tolerance)
    if found is None:
        return hinge
    told.append(_record((hinge.name,), f'hinge "{hinge.name}"', found[1]))
    return hinge.model_copy(update={"orientation": found[0]})


def _body(body: Body, tolerance: float, told: list[Simplification]) -> Body:
    ends = dict(body.ends)
    for name, end in body.ends.items():
        found = nearest_right_angles(end.rotation, tolerance)
        if found is not None:
            ends[name] = end.model_copy(update={"orientation": found[0]})
            told.append(_record((body.name, name), f'end "{body.name}.{name}"', found[1]))
    return body if ends == body.ends else body.model_copy(update={"ends": ends})


def _record(elements: tuple[str, ...], what: str, off: float) -> Simplification:
    text = f"{what}: its orientation is {off:.1e} rad off quarter turns, and packed as these"
    return Simplification(TURNS, elements, text)


def nearest_right_angles(rotation: Matrix, tolerance: float) -> tuple[Vector, float] | None:
    """Roll, pitch and yaw of the quarter turns from which a rotation differs by more than rounding
    and up to `tolerance`, and by how much (rad); None where there are none."""
    nearest = tuple(tuple(float(round(x)) for x in row) for row in rotation)
    squares = (
        (x - y) ** 2
        for row, exact in zip(rotation, nearest, strict=True)
        for x, y in zip(row, exact, strict=True)
    )
    off = math.sqrt(sum(squares) / 2.0)
    if not _ROUNDING < off <= tolerance:
        return None
    return next((rpy, off) for rpy, matrix in _quarters() if matrix == nearest)


def _quarters() -> Iterator[tuple[Vector, Matrix]]:
    turns = [k * (math.pi / 2) for k in range(4)]
    for roll, pitch, yaw in product(turns, repeat=3):
        yield (roll, pitch, yaw), from_rpy((roll, pitch, yaw))
