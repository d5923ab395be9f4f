"""Merged mass, mass centre and inertia of links welded into one body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ...numerics.pose import IDENTITY_POSE, ZERO, Pose
from ...numerics.rotations import Matrix, Vector, product, transpose
from ..validators.inertia import is_rounding
from .robot_model import ZERO_MATRIX, ImportNote, Link, Robot


def merge_inertia(parts: Sequence[tuple[Link, Pose]]) -> tuple[float, Vector, Matrix]:
    """Merge links to one body: mass (kg), mass centre (m) and inertia about it (kg m^2).

    Each link is given with its frame in the axes of the body; the results are in these axes.
    """
    if len(parts) == 1 and parts[0][1] == IDENTITY_POSE:
        link = parts[0][0]
        return link.mass, link.center, link.inertia
    mass = sum(link.mass for link, _ in parts)
    mass_centres = [pose.compose(Pose(link.center)).position for link, pose in parts]
    center = ZERO
    if mass > 0:
        x, y, z = (
            sum(
                link.mass * mass_centre[i]
                for (link, _), mass_centre in zip(parts, mass_centres, strict=True)
            )
            / mass
            for i in range(3)
        )
        center = (x, y, z)
    inertia = ZERO_MATRIX
    for (link, pose), mass_centre in zip(parts, mass_centres, strict=True):
        rotated_inertia = product(product(pose.rotation, link.inertia), transpose(pose.rotation))
        arm = [mass_centre[i] - center[i] for i in range(3)]
        inertia = _add_inertia(inertia, rotated_inertia, link.mass, arm)
    return mass, center, inertia


def remove_rounding_inertia(robot: Robot) -> Robot:
    """Remove inertia of massless links that is rounding compared with the other links."""
    largest_entries = {
        link.name: max(abs(x) for row in link.inertia for x in row) for link in robot.links
    }
    largest, mass = (
        max(largest_entries.values(), default=0.0),
        sum(link.mass for link in robot.links),
    )
    affected_links = [
        link
        for link in robot.links
        if link.mass == 0
        and largest_entries[link.name] > 0
        and is_rounding(largest_entries[link.name], largest, mass)
    ]
    if not affected_links:
        return robot
    note_text = "no mass, and an inertia that is rounding; both are treated as zero"
    notes = (ImportNote(link.where, f"link {link.name!r}", note_text) for link in affected_links)
    names = {link.name for link in affected_links}
    links = tuple(
        replace(link, inertia=ZERO_MATRIX) if link.name in names else link for link in robot.links
    )
    return replace(robot, links=links, notes=(*robot.notes, *notes))


def _add_inertia(total: Matrix, inertia: Matrix, mass: float, arm: Sequence[float]) -> Matrix:
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
