"""Numbers of cut hinges and constraints in internal frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..system import BodyNumbers, BodyRun, ClosureNumbers
from .constraint_numbers import constraint_closure

if TYPE_CHECKING:
    from ..scene_frames import Frames
    from .cut_tree import Cut


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
            yield constraint_closure(cut.constraint, frames, place)


def _cut_hinge_closure(frames: Frames, cut: Cut, place: int, frame: BodyNumbers) -> ClosureNumbers:
    """Closure of a cut hinge; speeds that are prescribed or have a rotor get rows as well."""
    frame_placement, body_placement = (frames.placements[name] for name in (cut.frame, cut.body))
    turn = body_placement.axes(frame_placement.rotation)
    constrained = [k for k in range(frame.nu) if frame.imposed[k] or frame.rotor[k]]
    return ClosureNumbers(
        place, frames.positions[cut.body], (*turn[0], *turn[1], *turn[2]),
        body_placement.point(frame_placement.origin), (*constrained, *range(frame.nu, 6)),
    )  # fmt: skip
