"""Merged mass, mass centre and inertia of links welded into one body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...numbers.pose import IN_PLACE, ZERO, Pose
from ...numbers.rotations import Matrix, Vector, product, transpose
from ..rules.inertia import is_dust
from .robot import NOTHING, Link, Note, Robot


def joined(parts: Sequence[tuple[Link, Pose]]) -> tuple[float, Vector, Matrix]:
    """Merge links to one body: mass (kg), mass centre (m) and inertia about it (kg m^2).

    Each link is given with its frame in the axes of the body; the results are in these axes.
    """
    if len(parts) == 1 and parts[0][1] == IN_PLACE:
        link = parts[0][0]
        return link.mass, link.center, link.inertia
    mass = sum(link.mass for link, _ in parts)
    places = [pose.then(Pose(link.center)).position for link, pose in parts]
    center = ZERO
    if mass > 0:
        x, y, z = (
            sum(link.mass * place[i] for (link, _), place in zip(parts, places, strict=True)) / mass
            for i in range(3)
        )
        center = (x, y, z)
    inertia = NOTHING
    for (link, pose), place in zip(parts, places, strict=True):
        turned = product(product(pose.rotation, link.inertia), transpose(pose.rotation))
        arm = [place[i] - center[i] for i in range(3)]
        inertia = _plus(inertia, turned, link.mass, arm)
    return mass, center, inertia


def without_dust(robot: Robot) -> Robot:
    """Remove inertia of massless links that is rounding compared with the other links."""
    entries = {link.name: max(abs(x) for row in link.inertia for x in row) for link in robot.links}
    largest, mass = max(entries.values(), default=0.0), sum(link.mass for link in robot.links)
    dust = [
        link for link in robot.links
        if link.mass == 0 and entries[link.name] > 0 and is_dust(entries[link.name], largest, mass)
    ]  # fmt: skip
    if not dust:
        return robot
    what = "no mass, and an inertia that is rounding; both are treated as zero"
    notes = (Note(link.where, f"link {link.name!r}", what) for link in dust)
    names = {link.name for link in dust}
    links = tuple(
        replace(link, inertia=NOTHING) if link.name in names else link for link in robot.links
    )
    return replace(robot, links=links, notes=(*robot.notes, *notes))


def _plus(total: Matrix, inertia: Matrix, mass: float, arm: Sequence[float]) -> Matrix:
    """Add an inertia by the parallel axis theorem: J + m (a.a 1 - a a^T)."""
    square = sum(a * a for a in arm)
    rows = [
        tuple(
            total[i][j]
            + (inertia[i][j] + inertia[j][i]) / 2
            + mass * ((square if i == j else 0.0) - arm[i] * arm[j])
            for j in range(3)
        )
        for i in range(3)
    ]
    a, b, c = rows
    return ((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2]))
