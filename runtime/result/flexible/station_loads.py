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
    from ...flexible.modal_parts import Station
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
    outer = x >= start if start < exact.length else x > start
    rotations, positions = exact.poses(motion.eta, x)
    force, moment = np.zeros((2, len(motion.t), len(x), 3))
    for load in _own_loads(flexible, motion, samples):
        begin, end = load.part
        length, is_outer = end - begin, (begin + end) / 2 >= start
        cut = np.clip(x, begin, end)
        # Part of the load beyond the section, and how far its centre is from that of the whole.
        beyond = end - cut if is_outer else cut - begin
        share = beyond / length if length else (begin >= x if is_outer else x >= begin)
        share = np.where(outer == is_outer, share, 0.0) * (1.0 if is_outer else -1.0)
        shift = (length - beyond) / 2 * (1.0 if is_outer else -1.0)
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
    parts = _parts(body)
    for k, load in enumerate(across):
        if load is None:
            continue
        force, moment = load
        for j, station in enumerate(body.stations):
            next_load = across[j]
            if station.previous == k and next_load is not None:
                lever = points[:, j] - points[:, k]
                moment = moment - next_load[1] - np.cross(lever, next_load[0])
                force = force - next_load[0]
        yield _OwnLoad(parts[k], points[:, k], rotations[:, k, :, 0], force, moment)


def _parts(body: ModalBody) -> list[tuple[float, float]]:
    """Part of the beam that each station or end stands for, m."""
    assert body.exact is not None
    masses = [station for station in body.stations if not station.end and station.mass]
    borders = _borders(body, masses)
    parts = {id(station): borders[k] for k, station in enumerate(sorted(masses, key=_place))}
    return [parts.get(id(station), (station.x, station.x)) for station in body.stations]


def _place(station: Station) -> float:
    return station.x


def _borders(body: ModalBody, masses: list[Station]) -> list[tuple[float, float]]:
    """Begin and end of the part of each slice, from root to tip: its share of the mass of a piece.

    The weights of Gauss points add up to the lengths of the pieces.
    """
    assert body.exact is not None
    edges, begin = [], 0.0
    for station in sorted(masses, key=_place):
        density = float(body.exact.sections(np.array([station.x])).mass_per_length[0])
        end = min(begin + station.mass / density, body.exact.length)
        edges.append((begin, end))
        begin = end
    return edges
