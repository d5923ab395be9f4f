"""Section loads of an exact beam from equilibrium: sums of the loads on its stations.

The load across the segment to a station balances everything beyond: inertia, gravity and loads of
slices and ends.  The load of a slice is spread evenly over the length that it stands for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from .motion import Motion
    from .section_loads import FlexibleBodies


def station_loads(
    flexible: FlexibleBodies, motion: Motion, x: Array, samples: Any = slice(None)
) -> tuple[Array, Array]:
    """Section force (n, m, 3) in N and moment (n, m, 3) in N*m at x (m,), section axes.

    Of the part beyond x on the part before it, with the signs of `section_loads`; `motion` is that
    at these samples of the run.
    """
    exact = motion.body.exact
    assert exact is not None
    start = exact.chain.start
    on_tip_side = x >= start if start < exact.length else x > start
    rotations, positions = exact.poses(motion.eta, x)
    force, moment = np.zeros((2, len(motion.t), len(x), 3))
    for load in _own_loads(flexible, motion, samples):
        begin, end = load.part
        length, is_tip_side = end - begin, (begin + end) / 2 >= start
        cut = np.clip(x, begin, end)
        # Part of the load beyond the section, and how far its centre is from that of the whole.
        beyond = end - cut if is_tip_side else cut - begin
        share = beyond / length if length else (begin >= x if is_tip_side else x >= begin)
        share = np.where(on_tip_side == is_tip_side, share, 0.0) * (1.0 if is_tip_side else -1.0)
        shift = (length - beyond) / 2 * (1.0 if is_tip_side else -1.0)
        place = load.place[:, None] + load.axis[:, None] * shift[:, None]
        own_force = load.force[:, None]
        force += share[:, None] * own_force
        moment += share[:, None] * (load.moment[:, None] + np.cross(place - positions, own_force))
    return np.einsum("tmji,tmj->tmi", rotations, force), np.einsum(
        "tmji,tmj->tmi", rotations, moment
    )


@dataclass(frozen=True)
class _OwnLoad:
    """Inertia, gravity and outer loads of a station or an end, frame axes.

    It acts on `part` of the beam (m), at `place` (n, 3) with the axis of the beam along `axis`.
    """

    part: tuple[float, float]
    place: Array
    axis: Array
    force: Array
    moment: Array


def _own_loads(flexible: FlexibleBodies, motion: Motion, samples: Any) -> Iterator[_OwnLoad]:
    """Loads of the stations and ends: that across each segment less those of the next ones."""
    body = motion.body
    assert body.exact is not None
    across: list[tuple[Array, Array] | None] = []
    for k, station in enumerate(body.stations):
        load = flexible.load_at_end(body.name, station.end or f"station {k + 1}")
        across.append(load and (motion.inward(load[0][samples]), motion.inward(load[1][samples])))
    sections = np.array([station.x for station in body.stations])
    rotations, points = body.exact.poses(motion.eta, sections)
    own = list(across)
    for k, station in enumerate(body.stations):
        inboard, outboard = own[station.previous], across[k]
        if station.previous >= 0 and inboard is not None and outboard is not None:
            lever = points[:, k] - points[:, station.previous]
            moment = inboard[1] - outboard[1] - np.cross(lever, outboard[0])
            own[station.previous] = inboard[0] - outboard[0], moment
    for k, (load, part) in enumerate(zip(own, _parts(body), strict=True)):
        if load is not None:
            yield _OwnLoad(part, points[:, k], rotations[:, k, :, 0], *load)


def _parts(body: ModalBody) -> list[tuple[float, float]]:
    """Part of the beam (m) that each station or end stands for, from begin to end.

    The lengths of the slices add up to that of the beam.
    """
    assert body.exact is not None
    parts, begin = [(station.x, station.x) for station in body.stations], 0.0
    for k in sorted(range(len(parts)), key=lambda k: body.stations[k].x):
        length = body.stations[k].length
        if length:
            parts[k] = begin, min(begin + length, body.exact.length)
            begin += length
    return parts
