"""Default geometry of rigid bodies from their ends, mass and inertia."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.tables.body import BodyTable

from .scene_graph import Solid
from .solid_meshes import (
    Colour,
    Surface,
    bar_surface,
    box_surface,
    ellipsoid_surface,
    join_surfaces,
)

#: Radius of a bar relative to its length, usual and at most, and its bounds relative to the size of
#: the scene.
_RADIUS_TO_LENGTH, _MAX_RADIUS_TO_LENGTH, _MIN_RADIUS_TO_SIZE, _MAX_RADIUS_TO_SIZE = (
    0.035,
    0.15,
    0.0025,
    0.012,
)
#: Radius of the ball at the mass centre relative to that of a bar.
_BALL_RADIUS_RATIO = 1.9
#: Points closer than this, relative to the size of the scene, are identical.
_POINT_TOLERANCE = 1e-6
#: A box of equal inertia is drawn if its edges are below this, relative to the size of the scene:
#: with bars, and for bodies without other data.
_MAX_BOX_BESIDE_BARS, _MAX_BOX_ALONE = 0.6, 4.0


def rigid_body_solids(
    name: str, body: BodyTable, hub: bool, size: float, colour: Colour
) -> Iterator[Solid]:
    """Solids of a rigid body: bars to every end, and a ball at the mass centre.

    Bars start at the origin (`hub`: a hinge is attached there) or at the mass centre. The box of
    the same mass and inertia is added: visible without bars, transparent and hidden with bars.
    `size` in m is that of the scene.
    """
    centre = np.array(body.center_of_mass)
    root = np.zeros(3) if hub or body.type != "rigid" else centre
    points = [np.array(body.end_position(end)) for end in body.ends]
    if body.type == "rigid":
        points.append(centre)
    outer_points = [p for p in points if np.linalg.norm(p - root) > _POINT_TOLERANCE * size]
    radii = [bar_radius(float(np.linalg.norm(p - root)), size) for p in outer_points]
    owner = f"bodies/{name}"
    if outer_points:
        bars = [bar_surface(root, p, r) for p, r in zip(outer_points, radii, strict=True)]
        yield Solid(owner, "bars", join_surfaces(bars), colour)
    radius = _BALL_RADIUS_RATIO * (max(radii) if radii else _MAX_RADIUS_TO_SIZE * size)
    inertia_box = equal_inertia_box(
        body, size, _MAX_BOX_BESIDE_BARS if outer_points else _MAX_BOX_ALONE
    )
    if inertia_box is not None:
        is_transparent = bool(outer_points)
        yield Solid(
            owner,
            "inertia",
            inertia_box,
            colour,
            0.3 if is_transparent else 1.0,
            hidden=is_transparent,
        )
    if (body.mass and outer_points) or inertia_box is None:
        ball = ellipsoid_surface((radius, radius, radius), 12).with_pose(centre)
        yield Solid(owner, "mass", ball, _darken(colour))


def bar_radius(length: float, size: float) -> float:
    """Radius in m of a bar of this length in a scene of this size."""
    usual = float(
        np.clip(_RADIUS_TO_LENGTH * length, _MIN_RADIUS_TO_SIZE * size, _MAX_RADIUS_TO_SIZE * size)
    )
    return min(usual, _MAX_RADIUS_TO_LENGTH * length)


def body_bar_radius(body: BodyTable, size: float) -> float:
    """Radius in m of the thickest bar of a body, or the largest radius if it has no bar."""
    ends = [np.linalg.norm(body.end_position(end)) for end in body.ends]
    longest = float(max(ends, default=0.0))
    return bar_radius(longest, size) if longest > 0 else _MAX_RADIUS_TO_SIZE * size


def equal_inertia_box(
    body: BodyTable, size: float, most: float = _MAX_BOX_BESIDE_BARS
) -> Surface | None:
    """Homogeneous box with the same mass, mass centre and inertia.

    None if there is none, or if it would hide the scene: larger than `most` times its size.

    Edges a, b, c have moments m (b^2 + c^2) / 12 and so on, so a^2 = 6 (Jy + Jz - Jx) / m.
    """
    if body.type != "rigid" or not body.mass:
        return None
    moments, axes = np.linalg.eigh(np.array(body.inertia_matrix))
    squares = 6 * (moments.sum() - 2 * moments) / body.mass
    edges = np.sqrt(np.clip(squares, 0.0, None))
    if not edges.max() > _MAX_RADIUS_TO_SIZE * size or edges.max() > most * size:
        return None
    edges = np.maximum(edges, _MIN_RADIUS_TO_SIZE * size)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return box_surface(edges).with_pose(body.center_of_mass, axes)


def body_centre(body: BodyTable) -> Array:
    """Label position of a body: its mass centre, or the mean of its ends."""
    if body.type == "rigid" and body.mass:
        return np.array(body.center_of_mass)
    ends = [body.end_position(end) for end in body.ends]
    return np.mean([(0.0, 0.0, 0.0), *ends], axis=0)


def _darken(colour: Colour) -> Colour:
    r, g, b = (int(0.55 * c) for c in colour)
    return (r, g, b)
