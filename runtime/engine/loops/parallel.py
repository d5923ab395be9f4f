"""Loops of pins and prismatic hinges whose axes are parallel but for a small angle.

Such a loop moves in a plane or not at all, so that the angle is an oversight, whatever it does:
lock, leave no freedom, or not close.  Between two pins that follow each other around a loop nothing
turns, so that the angles between their axes are those of the scene in every pose.
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

#: The largest angle (rad) that is small, and the least that may let rows count which repeat others
#: where axes are parallel.
_SMALL, COUNTING = 0.1, 1e-4
#: Gaps (m, rad) that an angle leaves, in parts of it, for lengths of 1 m; and angles that are
#: rounding, rad.
_LEAVES, _ROUNDING = 4.0, 1e-9
#: So many hinges move a loop in a plane.
_MOVING = 4
#: Angles at both neighbours of a hinge that is off, in parts of the larger, and all others.
_BOTH, _OTHERS = 0.5, 0.1


@dataclass(frozen=True)
class _Skew:
    """`angle` (rad) by which the axes of two hinges on one body are off: from parallel, or a
    prismatic one from the plane across the pins beside it."""

    angle: float
    hinges: tuple[Hinge, ...]
    body: str


def skewed_by_gap(packed: Packed, gap: float) -> str:
    """As `skewed`, by angles that may leave a gap (m, rad)."""
    return skewed(packed, gap / (_LEAVES * max(1.0, length_of(packed.system))))


def skewed(packed: Packed, least: float) -> str:
    """Which axis of a closed loop is off from parallel by `least` to 0.1 rad, and what to do, as
    words that end a message; empty where none is."""
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
    """Of pins that follow each other around a loop, and of what slides where all pins are parallel;
    empty where other hinges are in it, less than two pins, or too few to move it in a plane."""
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
    """Two pins that follow each other around a loop, their axes where nothing turns, the body on
    which the first stands, and with their axes the prismatic hinges between them."""
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
    """Axes of a hinge at rest in those of `body`, which it joins, and in those of the other one;
    that other one."""
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
    """The angle (rad) between two lines."""
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), abs(float(one @ other)))


# --- words ----------------------------------------------------------------------------------------


def _words(skews: list[_Skew]) -> str:
    ranked = sorted(skews, key=lambda skew: skew.angle, reverse=True)
    worst, others = ranked[0], ranked[2:]
    off = f"{worst.angle:.3g} rad ({math.degrees(worst.angle):.3g} deg)"
    if len(worst.hinges) == 1:
        return (
            f'the axis of hinge "{worst.hinges[0].name}" is {off} out of the plane in which the '
            "pins of its loop turn; lay it in that plane by an exact axis and orientation, or take "
            "a cylindrical hinge in place of one of the pins"
        )
    shared = [one for one in worst.hinges if one in ranked[1].hinges]
    alone = all(skew.angle < _OTHERS * worst.angle for skew in others)
    if len(shared) == 1 and alone and ranked[1].angle > _BOTH * worst.angle:
        (hinge,) = shared
        beside = [one.name for skew in ranked[:2] for one in skew.hinges if one is not hinge]
        return (
            f'the axis of hinge "{hinge.name}" is {off} from parallel to those of "{beside[0]}" '
            f'and "{beside[1]}" beside it in the loop; make it parallel by an exact axis and '
            "orientation, or take a ball hinge in its place"
        )
    one, other = worst.hinges
    where = "ground" if worst.body == "ground" else f'body "{worst.body}"'
    return (
        f'the axes of hinges "{one.name}" and "{other.name}" on {where} are {off} from parallel; '
        "make them parallel by an exact axis and orientation, or take a ball hinge in place of "
        "the one that is off"
    )
