"""Numbers of cut hinges and constraints in internal frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from mstmm.numerics.rotations import IDENTITY, rotate
from mstmm.scene import Constraint
from mstmm.scene.tables.closures import CURVE, DISTANCE, PLANE

from ..system import BodyNumbers, BodyRun, ClosureNumbers

if TYPE_CHECKING:
    from ..scene_frames import Frames
    from .cut_tree import Cut

#: Identity rotation, row by row.
_IDENTITY = (*IDENTITY[0], *IDENTITY[1], *IDENTITY[2])


def closure_numbers(frames: Frames, runs: Sequence[BodyRun]) -> Iterator[ClosureNumbers]:
    """Closures of the cut hinges, then of the constraints."""
    if not frames.expanded.cuts:
        return
    first_bodies = {run.position: run.members[0] for run in runs}
    for cut in frames.expanded.cuts:
        place = frames.positions[cut.frame]
        if cut.constraint is None:
            yield _cut_hinge_closure(frames, cut, place, first_bodies[place])
        else:
            yield _constraint_closure(cut.constraint, frames, place)


def _cut_hinge_closure(frames: Frames, cut: Cut, place: int, frame: BodyNumbers) -> ClosureNumbers:
    """Closure of a cut hinge; speeds that are prescribed or have a rotor get rows as well."""
    frame_placement, body_placement = (frames.placements[name] for name in (cut.frame, cut.body))
    turn = body_placement.axes(frame_placement.rotation)
    constrained = [k for k in range(frame.nu) if frame.imposed[k] or frame.rotor[k]]
    return ClosureNumbers(
        place, frames.positions[cut.body], (*turn[0], *turn[1], *turn[2]),
        body_placement.point(frame_placement.origin), (*constrained, *range(frame.nu, 6)),
    )  # fmt: skip


def _constraint_closure(constraint: Constraint, frames: Frames, place: int) -> ClosureNumbers:
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
