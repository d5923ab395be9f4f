"""Hinges that close loops -> their numbers in internal frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..system import BodyRun, ClosureNumbers

if TYPE_CHECKING:
    from ..frames import Frames


def closures_of(frames: Frames, runs: Sequence[BodyRun]) -> Iterator[ClosureNumbers]:
    """The hinge's own speeds have rows where something imposes them or a rotor hangs on them."""
    if not frames.expanded.cuts:
        return
    alone = {run.place: run.alike[0] for run in runs}
    for cut in frames.expanded.cuts:
        own, other = (frames.placements[name] for name in (cut.frame, cut.body))
        turn, place = other.axes(own.rotation), frames.positions[cut.frame]
        frame = alone[place]
        bound = [k for k in range(frame.nu) if frame.imposed[k] or frame.rotor[k]]
        yield ClosureNumbers(
            place, frames.positions[cut.body], (*turn[0], *turn[1], *turn[2]),
            other.point(own.origin), (*bound, *range(frame.nu, 6)),
        )  # fmt: skip
