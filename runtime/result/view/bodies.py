"""Rigid bodies as they are drawn when nothing is known but their ends, mass and inertia."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.arrays import Array
from mstmm.scene.tables.body import BodyTable

from .solids import Colour, Surface, bar, box, ellipsoid, joined
from .stage import Solid

#: Radius of a bar by its length, usual and at most, and its bounds by the size of the scene.
_SLENDER, _STOUT, _THINNEST, _THICKEST = 0.035, 0.15, 0.0025, 0.012
#: Radius of the ball at the mass centre beside that of a bar.
_BALL = 1.9
#: Points closer than this by the size of the scene are one.
_SAME = 1e-6
#: A box of equal inertia is drawn if its edges are below this by the size of the scene: beside
#: bars, and where nothing else is known of a body.
_FITS, _ALONE = 0.6, 4.0


def rigid(name: str, body: BodyTable, hub: bool, size: float, colour: Colour) -> Iterator[Solid]:
    """Bars from the origin (`hub`: something is joined there) or from the mass centre to every end,
    and a ball at the mass centre; the box of the same mass and inertia where there is no bar, and
    clear and hidden where there is one.  `size` in m is that of the scene."""
    centre = np.array(body.center_of_mass)
    root = np.zeros(3) if hub or body.type != "rigid" else centre
    points = [np.array(body.end_position(end)) for end in body.ends]
    if body.type == "rigid":
        points.append(centre)
    reached = [p for p in points if np.linalg.norm(p - root) > _SAME * size]
    radii = [thickness(float(np.linalg.norm(p - root)), size) for p in reached]
    owner = f"bodies/{name}"
    if reached:
        bars = [bar(root, p, r) for p, r in zip(reached, radii, strict=True)]
        yield Solid(owner, "bars", joined(bars), colour)
    radius = _BALL * (max(radii) if radii else _THICKEST * size)
    block = equal_inertia(body, size, _FITS if reached else _ALONE)
    if block is not None:
        clear = bool(reached)
        yield Solid(owner, "inertia", block, colour, 0.3 if clear else 1.0, hidden=clear)
    if (body.mass and reached) or block is None:
        ball = ellipsoid((radius, radius, radius), 12).placed(centre)
        yield Solid(owner, "mass", ball, _dark(colour))


def thickness(length: float, size: float) -> float:
    """Radius in m of a bar of this length in a scene of this size."""
    usual = float(np.clip(_SLENDER * length, _THINNEST * size, _THICKEST * size))
    return min(usual, _STOUT * length)


def girth(body: BodyTable, size: float) -> float:
    """Radius in m of the thickest bar of a body, or of the thickest there is where it has none."""
    ends = [np.linalg.norm(body.end_position(end)) for end in body.ends]
    longest = float(max(ends, default=0.0))
    return thickness(longest, size) if longest > 0 else _THICKEST * size


def equal_inertia(body: BodyTable, size: float, most: float = _FITS) -> Surface | None:
    """The homogeneous box with the same mass, mass centre and inertia; None where there is none or
    it would hide the scene, larger than `most` times its size.

    Edges a, b, c have moments m (b^2 + c^2) / 12 and so on, so a^2 = 6 (Jy + Jz - Jx) / m.
    """
    if body.type != "rigid" or not body.mass:
        return None
    moments, axes = np.linalg.eigh(np.array(body.inertia_matrix))
    squares = 6 * (moments.sum() - 2 * moments) / body.mass
    edges = np.sqrt(np.clip(squares, 0.0, None))
    if not edges.max() > _THICKEST * size or edges.max() > most * size:
        return None
    edges = np.maximum(edges, _THINNEST * size)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return box(edges).placed(body.center_of_mass, axes)


def centre_of(body: BodyTable) -> Array:
    """Where a body is pointed at: its mass centre, or the mean of its ends."""
    if body.type == "rigid" and body.mass:
        return np.array(body.center_of_mass)
    ends = [body.end_position(end) for end in body.ends]
    return np.mean([(0.0, 0.0, 0.0), *ends], axis=0)


def _dark(colour: Colour) -> Colour:
    r, g, b = (int(0.55 * c) for c in colour)
    return (r, g, b)
