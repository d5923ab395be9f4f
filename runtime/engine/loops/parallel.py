"""Loops of pin and prismatic hinges whose axes are parallel except for a small angle.

Such a loop moves in a plane or not at all, so the angle is a mistake whatever its effect: the loop
locks, has no degree of freedom, or does not close.  Between two successive pins of a loop nothing
rotates, so that the angles between their axes are those of the scene in every pose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mstmm.arrays import Array
from mstmm.scene import Hinge, split
from mstmm.scene.checks.topology import build
from mstmm.scene.tables.all import SceneTables

from ...pack.loops.variants import length_of
from ...pack.packed import Packed

#: Largest angle (rad) that counts as small, and the smallest one that may make rows independent
#: that are redundant with parallel axes.
_SMALL, COUNTING = 0.1, 1e-4
#: Ratio of a gap (m, rad) to the angle that causes it, for lengths of 1 m; angles that are
#: rounding, rad.
_LEAVES, _ROUNDING = 4.0, 1e-9
#: Number of hinges of a loop that moves in a plane.
_MOVING = 4
#: A hinge is off alone if the smaller angle to its neighbours exceeds the first fraction of the
#: larger one, and all other angles are below the second.
_BOTH, _OTHERS = 0.5, 0.1


@dataclass(frozen=True)
class _Skew:
    """Angle (rad) between two hinge axes on one body that should be parallel.

    For a prismatic hinge: the angle from the plane perpendicular to the adjacent pins.
    """

    angle: float
    hinges: tuple[Hinge, ...]
    body: str


def skewed_by_gap(packed: Packed, gap: float) -> str:
    """Find skewed axes as `skewed` does, with angles that may cause a gap (m, rad)."""
    return skewed(packed, gap / (_LEAVES * max(1.0, length_of(packed.system))))


def skewed(packed: Packed, least: float) -> str:
    """End of a message that names an axis of a closed loop that is nearly parallel, with a remedy.

    Its angle is from `least` to 0.1 rad; empty if there is no such axis.
    """
    scene, worst = packed.described.skeleton, list[_Skew]()
    plan = build(scene).plan
    for cut in plan.cut if plan is not None else ():
        assert plan is not None
        found = _skews(scene, [scene.hinges[number] for number in plan.loop(cut)])
        if max(_largest(worst), least, _ROUNDING) < _largest(found) < _SMALL:
            worst = found
    return _words(worst) if worst else ""


def _largest(skews: list[_Skew]) -> float:
    return max((skew.angle for skew in skews), default=0.0)


def _skews(scene: SceneTables, loop: list[Hinge]) -> list[_Skew]:
    """Angles between successive pins of a loop, or of its prismatic hinges if these are larger.

    Empty if the loop contains other hinges, fewer than two pins, or too few hinges for a planar
    motion.
    """
    moving = sum(not hinge.is_weld for hinge in loop)
    if moving < _MOVING or not all(_is_axial(hinge) for hinge in loop):
        return []
    between = list(_between_pins(scene, loop))
    if len(between) < 2:
        return []
    pins = [_Skew(_apart(*axes), hinges, body) for hinges, axes, body, _ in between]
    slides = [
        _Skew(abs(_apart(axes[0], axis) - math.pi / 2), (hinge,), body)
        for _, axes, body, sliding in between
        for hinge, axis in sliding
    ]
    return pins if _largest(pins) >= _largest(slides) / 2 else slides


def _is_axial(hinge: Hinge) -> bool:
    facts = hinge.facts
    return facts is not None and (facts.welds or facts.axial)


def _between_pins(
    scene: SceneTables, loop: list[Hinge]
) -> Iterator[tuple[tuple[Hinge, Hinge], tuple[Array, Array], str, list[tuple[Hinge, Array]]]]:
    """Successive pins of a loop, their axes in one frame, and prismatic hinges between them.

    Also the body outboard of the first pin, and the axes of the prismatic hinges.
    """
    pins = [k for k, hinge in enumerate(loop) if hinge.facts and hinge.facts.turns]
    body = split(loop[0].inboard)[0]
    for hinge in loop[: pins[0]] if pins else ():
        body = _sides(scene, hinge, body)[2]
    for at, first in enumerate(pins):
        following = pins[(at + 1) % len(pins)] + len(loop) * (at + 1 == len(pins))
        _, near, body = _sides(scene, loop[first], body)
        start, turn, sliding = body, np.eye(3), list[tuple[Hinge, Array]]()
        for k in range(first + 1, following):
            hinge = loop[k % len(loop)]
            before, behind, body = _sides(scene, hinge, body)
            if not hinge.is_weld:
                sliding.append((hinge, turn @ before @ hinge.unit_axis))
            turn = turn @ before @ behind.T
        last = loop[following % len(loop)]
        axes = near @ loop[first].unit_axis, turn @ _sides(scene, last, body)[0] @ last.unit_axis
        yield (loop[first], last), axes, start, sliding


def _sides(scene: SceneTables, hinge: Hinge, body: str) -> tuple[Array, Array, str]:
    """Axes of a hinge at rest in the axes of `body` and of the other body, and that body's name."""
    inboard = _end(scene, hinge.inboard) @ np.array(hinge.rotation)
    outboard, other = _end(scene, hinge.outboard), split(hinge.inboard)[0]
    if body == other:
        return inboard, outboard, hinge.outboard_body
    return outboard, inboard, other


def _end(scene: SceneTables, reference: str) -> Array:
    name, at = split(reference)
    found = scene.bodies.find(name)
    return np.eye(3) if found is None else np.array(scene.bodies[found].end_rotation(at))


def _apart(one: Array, other: Array) -> float:
    """Angle (rad) between two lines."""
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), abs(float(one @ other)))


# --- words ----------------------------------------------------------------------------------------


def _words(skews: list[_Skew]) -> str:
    ranked = sorted(skews, key=lambda skew: skew.angle, reverse=True)
    worst, others = ranked[0], ranked[2:]
    off = f"{worst.angle:.3g} rad ({math.degrees(worst.angle):.3g} deg)"
    if len(worst.hinges) == 1:
        return (
            f'the axis of hinge "{worst.hinges[0].name}" is {off} out of the plane in which the '
            "pins of its loop rotate; put it in that plane by an exact axis and orientation, or "
            "replace one of the pins by a cylindrical hinge"
        )
    shared = [one for one in worst.hinges if one in ranked[1].hinges]
    alone = all(skew.angle < _OTHERS * worst.angle for skew in others)
    if len(shared) == 1 and alone and ranked[1].angle > _BOTH * worst.angle:
        (hinge,) = shared
        beside = [one.name for skew in ranked[:2] for one in skew.hinges if one is not hinge]
        return (
            f'the axis of hinge "{hinge.name}" is {off} from parallel to those of "{beside[0]}" '
            f'and "{beside[1]}" next to it in the loop; make it parallel by an exact axis and '
            "orientation, or replace it by a ball hinge"
        )
    one, other = worst.hinges
    where = "ground" if worst.body == "ground" else f'body "{worst.body}"'
    return (
        f'the axes of hinges "{one.name}" and "{other.name}" on {where} are {off} from parallel; '
        "make them parallel by an exact axis and orientation, or replace one of them by a ball "
        "hinge"
    )
