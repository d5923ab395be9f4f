"""Section loads of an exact beam from equilibrium: sums of the loads on its stations.

The load across the segment to a station balances everything beyond: inertia, gravity and loads of
slices and ends.  The load of a slice is spread evenly over the length that it stands for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from .motion import section_rotation_matrices

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ...flexible.modal_parts import Station
    from .motion import Motion
    from .section_loads import FlexibleBodies


def station_loads(flexible: FlexibleBodies, motion: Motion, x: Array) -> tuple[Array, Array]:
    """Section force (n, m, 3) in N and moment (n, m, 3) in N*m at x (m,), section axes.

    Of the part beyond x on the part before it, with the signs of `section_loads`.
    """
    exact = motion.body.exact
    assert exact is not None
    start = exact.chain.start
    positions = exact.poses(motion.eta, x)[1]
    force, moment = np.zeros((2, len(motion.t), len(x), 3))
    for section, place, own_force, own_moment in _own_loads(flexible, motion):
        outer = x >= start if start < exact.length else x > start
        share = np.clip((section[1] - x) / max(section[1] - section[0], 1e-300), 0.0, 1.0)
        share = np.where(outer, share, share - 1.0)
        share[outer != (np.mean(section) >= start)] = 0.0
        force += share[:, None] * own_force[:, None]
        lever = place[:, None] - positions
        moment += share[:, None] * (own_moment[:, None] + np.cross(lever, own_force[:, None]))
    rotations = section_rotation_matrices(motion, x)
    return np.einsum("tmji,tmj->tmi", rotations, force), np.einsum(
        "tmji,tmj->tmi", rotations, moment
    )


def _own_loads(
    flexible: FlexibleBodies, motion: Motion
) -> list[tuple[tuple[float, float], Array, Array, Array]]:
    """Part of the beam, point, force and moment (n, 3) of the load on each station and end.

    Inertia, gravity and loads from outside, in frame axes; an end is a part without length.
    """
    body = motion.body
    assert body.exact is not None
    across = [
        flexible.load_at_end(body.name, station.end or f"station {k + 1}")
        for k, station in enumerate(body.stations)
    ]
    sections = np.array([station.x for station in body.stations])
    points = body.exact.poses(motion.eta, sections)[1]
    parts = _parts(body)
    loads = []
    for k, load in enumerate(across):
        if load is None:
            continue
        force, moment = motion.inward(load[0]), motion.inward(load[1])
        for j, station in enumerate(body.stations):
            beyond = across[j]
            if station.previous == k and beyond is not None:
                outer_force, outer_moment = map(motion.inward, beyond)
                force = force - outer_force
                lever = points[:, j] - points[:, k]
                moment = moment - outer_moment - np.cross(lever, outer_force)
        loads.append((parts[k], points[:, k], force, moment))
    return loads


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
