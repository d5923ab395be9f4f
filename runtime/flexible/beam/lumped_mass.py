"""The mass of a beam in points along it: slices that are rigid bodies (the quadrature variant)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..modal_port import MassPoint
from .gauss_quadrature import gauss
from .section_ports import BeamShapes
from .shape_fields import DIRECTIONS

#: Most numbers of second order that the sections of all points may hold together: a quarter of a
#: gigabyte, which every evaluation of the accelerations reads.
_MOST = 2**25


def mass_points(shapes: BeamShapes) -> tuple[MassPoint, ...]:
    """Gauss points with the slices' mass: 3 n + 4 of them, n shapes of the finest direction, shared
    by length among the pieces between changes of section and ends.

    Raises SceneError for more shapes than can be moved in so many points.
    """
    x, lengths = _rule(shapes)
    numbers = 6 * shapes.n**2 * len(x)
    if numbers > _MOST:
        raise SceneError(
            f'beam "{shapes.data.name}": {shapes.n} shapes need {len(x)} points of mass '
            f"(quadrature) and {8e-6 * numbers:.0f} MB for what their sections move by; expected "
            f"{8e-6 * _MOST:.0f} MB or less; give fewer shapes"
        )
    mass, yy, zz = shapes.data.inertia[:, shapes.data.piece(x)] * lengths
    inertia = [np.diag(about) for about in np.stack([yy + zz, zz, yy], axis=1)]
    return tuple(
        MassPoint(float(m), turning, port)
        for m, turning, port in zip(mass, inertia, shapes.ports(x), strict=True)
    )


def _rule(shapes: BeamShapes) -> tuple[Array, Array]:
    """Places of the points and the lengths of their slices, m."""
    n = max((sum(m.direction == d for m in shapes.modes) for d in DIRECTIONS), default=0)
    xs, lengths = [], []
    places = sorted({*shapes.breaks, *(x for x, _ in shapes.data.ends.values())})
    for a, b in pairwise(places):
        nodes, weights = gauss(max(4, int(np.ceil((3 * n + 4) * (b - a) / shapes.length))))
        xs.append(a + (b - a) * nodes)
        lengths.append((b - a) * weights)
    return np.concatenate(xs), np.concatenate(lengths)
