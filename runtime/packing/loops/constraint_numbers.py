"""Numbers of constraints in internal frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mstmm.numerics.rotations import IDENTITY, rotate
from mstmm.scene import Constraint
from mstmm.scene.tables.closures import CURVE, DISTANCE, PLANE

from ..system import ClosureNumbers

if TYPE_CHECKING:
    from ..scene_frames import Frames

#: Identity rotation, row by row.
_IDENTITY = (*IDENTITY[0], *IDENTITY[1], *IDENTITY[2])


def constraint_closure(constraint: Constraint, frames: Frames, place: int) -> ClosureNumbers:
    """Closure of a constraint whose frame is at position `place` in the tree."""
    body, axes, end = frames.end(constraint.to)
    if body < 0:
        end = constraint.position
    ends = (place, body, _IDENTITY, end)
    if constraint.type == DISTANCE:
        assert constraint.length is not None
        return ClosureNumbers(*ends, (0,), "distance", (constraint.length,), asked=1)
    if constraint.type == CURVE:  # direction 0 is the free speed along the curve
        return ClosureNumbers(*ends, (1, 2), asked=3)
    height = constraint.offset or 0.0
    if constraint.type == PLANE:
        return ClosureNumbers(*ends, (0,), "plane", (height,), asked=1)
    assert constraint.radius is not None
    axis = rotate((axes[0:3], axes[3:6], axes[6:9]), constraint.unit_axis)  # type: ignore[arg-type]
    p = (height, constraint.radius, *axis)
    return ClosureNumbers(*ends, (0, 1, 2), "rolling", p, speed_directions=(0, 1), asked=3)
