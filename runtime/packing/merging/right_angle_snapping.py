"""Replacement of orientations near right angles, such as 1.57079632679, by exact ones.

Zeros in their rotation matrices then need no code and no time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product

from mstmm.numerics.rotations import Matrix, Vector, from_rpy
from mstmm.scene import Body, Hinge, Scene

from .simplification import TURNS, Simplification

#: Largest deviation (rad) of an orientation that is exact up to rounding.
_ROUNDING = 1e-15


def with_right_angles(scene: Scene, tolerance: float) -> tuple[Scene, list[Simplification]]:
    """Make orientations near right angles exact, and record each change; chains are kept.

    Concerned are hinges and ends of bodies that deviate by at most `tolerance` (rad).
    """
    changes = list[Simplification]()
    hinges = tuple(_exact_hinge(hinge, tolerance, changes) for hinge in scene.hinge)
    bodies = tuple(_exact_body(body, tolerance, changes) for body in scene.body)
    if not changes:
        return scene, changes
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    return Scene.model_construct(**fields | {"hinge": hinges, "body": bodies}), changes


def _exact_hinge(hinge: Hinge, tolerance: float, changes: list[Simplification]) -> Hinge:
    nearest = nearest_right_angles(hinge.rotation, tolerance)
    if nearest is None:
        return hinge
    orientation, deviation = nearest
    changes.append(_record((hinge.name,), f'hinge "{hinge.name}"', deviation))
    return hinge.model_copy(update={"orientation": orientation})


def _exact_body(body: Body, tolerance: float, changes: list[Simplification]) -> Body:
    ends = dict(body.ends)
    for name, end in body.ends.items():
        nearest = nearest_right_angles(end.rotation, tolerance)
        if nearest is not None:
            orientation, deviation = nearest
            ends[name] = end.model_copy(update={"orientation": orientation})
            changes.append(_record((body.name, name), f'end "{body.name}.{name}"', deviation))
    return body if ends == body.ends else body.model_copy(update={"ends": ends})


def _record(elements: tuple[str, ...], what: str, deviation: float) -> Simplification:
    text = f"{what}: orientation {deviation:.1e} rad from right angles, replaced by these"
    return Simplification(TURNS, elements, text)


def nearest_right_angles(rotation: Matrix, tolerance: float) -> tuple[Vector, float] | None:
    """Roll, pitch and yaw of the nearest right-angle orientation, and the deviation (rad).

    None where the deviation is rounding only or exceeds `tolerance`.
    """
    nearest = tuple(tuple(float(round(x)) for x in row) for row in rotation)
    squares = (
        (x - y) ** 2
        for row, exact in zip(rotation, nearest, strict=True)
        for x, y in zip(row, exact, strict=True)
    )
    deviation = math.sqrt(sum(squares) / 2.0)
    if not _ROUNDING < deviation <= tolerance:
        return None
    return next((rpy, deviation) for rpy, matrix in _right_angles() if matrix == nearest)


def _right_angles() -> Iterator[tuple[Vector, Matrix]]:
    """All combinations of roll, pitch and yaw in right angles, and their rotation matrices."""
    angles = [k * (math.pi / 2) for k in range(4)]
    for roll, pitch, yaw in product(angles, repeat=3):
        yield (roll, pitch, yaw), from_rpy((roll, pitch, yaw))
