"""Nearly parallel axes in loops of pin and prismatic hinges.

Such a loop moves in a plane or not at all, so the angle is a modelling error in any case: the loop
locks, has no degree of freedom, or does not close.  Between two successive pins of a loop nothing
rotates, so that the angles between their axes are those of the scene in every pose.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene import Hinge, split_reference
from mstmm.scene.checks.topology import build_topology
from mstmm.scene.tables.scene_tables import SceneTables

from ...packing.packed_scene import PackedScene
from ...packing.system_variants import characteristic_length

#: Largest angle (rad) that counts as small, and the smallest angle at which rows that are redundant
#: with parallel axes may become independent.
_MAX_SMALL_ANGLE, MIN_COUNTING_ANGLE = 0.1, 1e-4
#: Ratio of a gap (m, rad) to the angle that causes it, for lengths of 1 m; angle that counts as
#: rounding, rad.
_GAP_PER_ANGLE, _ANGLE_ROUNDING = 4.0, 1e-9
#: Minimum number of hinges in a loop with planar motion.
_MIN_MOVING_HINGES = 4
#: A single hinge is misaligned if the smaller angle to its neighbours exceeds the first fraction of
#: the larger one, and all other angles are below the second.
_MIN_NEIGHBOUR_RATIO, _MAX_OTHER_RATIO = 0.5, 0.1


@dataclass(frozen=True)
class _Skew:
    """Angle (rad) between two hinge axes on one body that should be parallel.

    For a prismatic hinge: angle to the plane perpendicular to the adjacent pins.
    """

    angle: float
    hinges: tuple[Hinge, ...]
    body: str


def find_skewed_axis_by_gap(packed: PackedScene, gap: float) -> str:
    """Result of `find_skewed_axis` for angles that are large enough to cause a gap (m, rad)."""
    return find_skewed_axis(
        packed, gap / (_GAP_PER_ANGLE * max(1.0, characteristic_length(packed.system)))
    )


def find_skewed_axis(packed: PackedScene, least: float) -> str:
    """Message part that names a nearly parallel axis of a closed loop, with a remedy.

    Its angle is between `least` and 0.1 rad; empty if there is no such axis.
    """
    scene, worst_skews = packed.user_scene.skeleton, list[_Skew]()
    plan = build_topology(scene).plan
    for cut in plan.cut if plan is not None else ():
        assert plan is not None
        loop_skews = _loop_skews(scene, [scene.hinges[index] for index in plan.loop(cut)])
        if (
            max(_largest_angle(worst_skews), least, _ANGLE_ROUNDING)
            < _largest_angle(loop_skews)
            < _MAX_SMALL_ANGLE
        ):
            worst_skews = loop_skews
    return _skew_text(worst_skews) if worst_skews else ""


def _largest_angle(skews: list[_Skew]) -> float:
    return max((skew.angle for skew in skews), default=0.0)


def _loop_skews(scene: SceneTables, loop: list[Hinge]) -> list[_Skew]:
    """Angles between successive pins of a loop, or of its prismatic hinges if these are larger.

    Empty if the loop contains other hinges, fewer than two pins, or too few hinges for planar
    motion.
    """
    moving_count = sum(not hinge.is_weld for hinge in loop)
    if moving_count < _MIN_MOVING_HINGES or not all(_is_axial(hinge) for hinge in loop):
        return []
    pin_pairs = list(_successive_pins(scene, loop))
    if len(pin_pairs) < 2:
        return []
    pins = [_Skew(_line_angle(*axes), hinges, body) for hinges, axes, body, _ in pin_pairs]
    slides = [
        _Skew(abs(_line_angle(axes[0], axis) - math.pi / 2), (hinge,), body)
        for _, axes, body, sliding in pin_pairs
        for hinge, axis in sliding
    ]
    return pins if _largest_angle(pins) >= _largest_angle(slides) / 2 else slides


def _is_axial(hinge: Hinge) -> bool:
    facts = hinge.facts
    return facts is not None and (facts.welds or facts.axial)


def _successive_pins(
    scene: SceneTables, loop: list[Hinge]
) -> Iterator[tuple[tuple[Hinge, Hinge], tuple[Array, Array], str, list[tuple[Hinge, Array]]]]:
    """Successive pins of a loop, their axes in one frame, and prismatic hinges between them.

    Also yields the body after the first pin, and the axes of the prismatic hinges.
    """
    pins = [k for k, hinge in enumerate(loop) if hinge.facts and hinge.facts.turns]
    body = split_reference(loop[0].inboard)[0]
    for hinge in loop[: pins[0]] if pins else ():
        body = _hinge_axes(scene, hinge, body)[2]
    for pin_index, first in enumerate(pins):
        following = pins[(pin_index + 1) % len(pins)] + len(loop) * (pin_index + 1 == len(pins))
        _, pin_axes, body = _hinge_axes(scene, loop[first], body)
        start_body, rotation, sliding = body, np.eye(3), list[tuple[Hinge, Array]]()
        for k in range(first + 1, following):
            hinge = loop[k % len(loop)]
            inboard_axes, outboard_axes, body = _hinge_axes(scene, hinge, body)
            if not hinge.is_weld:
                sliding.append((hinge, rotation @ inboard_axes @ hinge.unit_axis))
            rotation = rotation @ inboard_axes @ outboard_axes.T
        next_pin = loop[following % len(loop)]
        axes = (
            pin_axes @ loop[first].unit_axis,
            rotation @ _hinge_axes(scene, next_pin, body)[0] @ next_pin.unit_axis,
        )
        yield (loop[first], next_pin), axes, start_body, sliding


def _hinge_axes(scene: SceneTables, hinge: Hinge, body: str) -> tuple[Array, Array, str]:
    """Axes of a hinge at rest in those of `body` and of the other body, and the other's name."""
    inboard = _end_rotation(scene, hinge.inboard) @ np.array(hinge.rotation)
    outboard, other_body = _end_rotation(scene, hinge.outboard), split_reference(hinge.inboard)[0]
    if body == other_body:
        return inboard, outboard, hinge.outboard_body
    return outboard, inboard, other_body


def _end_rotation(scene: SceneTables, reference: str) -> Array:
    name, end_name = split_reference(reference)
    index = scene.bodies.find(name)
    return np.eye(3) if index is None else np.array(scene.bodies[index].end_rotation(end_name))


def _line_angle(first_axis: Array, second_axis: Array) -> float:
    """Angle (rad) between two lines."""
    return math.atan2(
        float(np.linalg.norm(np.cross(first_axis, second_axis))),
        abs(float(first_axis @ second_axis)),
    )


# --- messages -------------------------------------------------------------------------------------


def _skew_text(skews: list[_Skew]) -> str:
    ranked_skews = sorted(skews, key=lambda skew: skew.angle, reverse=True)
    worst, other_skews = ranked_skews[0], ranked_skews[2:]
    angle_text = f"{worst.angle:.3g} rad ({math.degrees(worst.angle):.3g} deg)"
    if len(worst.hinges) == 1:
        return (
            f'the axis of hinge "{worst.hinges[0].name}" is {angle_text} out of the plane in '
            f"which the "
            "pins of its loop rotate; put it in that plane by an exact axis and orientation, or "
            "replace one of the pins by a cylindrical hinge"
        )
    shared_hinges = [
        first_hinge for first_hinge in worst.hinges if first_hinge in ranked_skews[1].hinges
    ]
    is_single = all(skew.angle < _MAX_OTHER_RATIO * worst.angle for skew in other_skews)
    if (
        len(shared_hinges) == 1
        and is_single
        and ranked_skews[1].angle > _MIN_NEIGHBOUR_RATIO * worst.angle
    ):
        (hinge,) = shared_hinges
        neighbour_names = [
            first_hinge.name
            for skew in ranked_skews[:2]
            for first_hinge in skew.hinges
            if first_hinge is not hinge
        ]
        return (
            f'the axis of hinge "{hinge.name}" is {angle_text} from parallel to those of '
            f'"{neighbour_names[0]}" '
            f'and "{neighbour_names[1]}" next to it in the loop; make it parallel by an exact '
            "axis and orientation, or replace it by a ball hinge"
        )
    first_hinge, second_hinge = worst.hinges
    location = "ground" if worst.body == "ground" else f'body "{worst.body}"'
    return (
        f'the axes of hinges "{first_hinge.name}" and "{second_hinge.name}" on {location} are '
        f"{angle_text} from parallel; "
        "make them parallel by an exact axis and orientation, or replace one of them by a ball "
        "hinge"
    )
