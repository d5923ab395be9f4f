"""What closes loops -> its numbers in internal frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..system import BodyNumbers, BodyRun, ClosureNumbers
from .constraint_numbers import constraint_closure

if TYPE_CHECKING:
    from ..scene_frames import Frames
    from .cut_tree import Cut


def closure_numbers(frames: Frames, runs: Sequence[BodyRun]) -> Iterator[ClosureNumbers]:
    """Those of cut hinges, then those of constraints."""
    if not frames.expanded.cuts:
        return
    alone = {run.place: run.alike[0] for run in runs}
    for cut in frames.expanded.cuts:
        place = frames.positions[cut.frame]
        if cut.constraint is None:
            yield _hinge(frames, cut, place, alone[place])
        else:
            yield constraint_closure(cut.constraint, frames, place)


def _hinge(frames: Frames, cut: Cut, place: int, frame: BodyNumbers) -> ClosureNumbers:
    """The hinge's own speeds have rows where something imposes them or a rotor hangs on them."""
    own, other = (frames.placements[name] for name in (cut.frame, cut.body))
    turn = other.axes(own.rotation)
    bound = [k for k in range(frame.nu) if frame.imposed[k] or frame.rotor[k]]
    return ClosureNumbers(
        place, frames.positions[cut.body], (*turn[0], *turn[1], *turn[2]),
        other.point(own.origin), (*bound, *range(frame.nu, 6)),
    )  # fmt: skip
