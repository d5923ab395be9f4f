"""Lumped mass of a beam: rigid slices along it (the quadrature variant)."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError

from ..modal_port import MassPoint
from .gauss_quadrature import gauss_rule
from .section_ports import BeamShapes
from .shape_fields import DIRECTIONS

#: Largest count of second-order coefficients at all mass points: a quarter of a gigabyte, which
#: every evaluation of the accelerations reads.
_MAX_NUMBERS = 2**25


def mass_points(shapes: BeamShapes) -> tuple[MassPoint, ...]:
    """Mass points of a beam, at Gauss points.

    There are 3 n + 4 for n shapes in the direction with the most, distributed by length over the
    pieces between section changes and ends.  Raises SceneError where they need too much memory.
    """
    x, lengths = _slices(shapes)
    count = 6 * shapes.n**2 * len(x)
    if count > _MAX_NUMBERS:
        raise SceneError(
            f'beam "{shapes.data.name}": {shapes.n} shapes need {len(x)} mass points (quadrature) '
            f"and {8e-6 * count:.0f} MB of second-order coefficients; expected "
            f"{8e-6 * _MAX_NUMBERS:.0f} MB or less; give fewer shapes"
        )
    mass, yy, zz = shapes.data.inertia[:, shapes.data.piece(x)] * lengths
    inertia = [np.diag(diagonal) for diagonal in np.stack([yy + zz, zz, yy], axis=1)]
    return tuple(
        MassPoint(float(m), tensor, port)
        for m, tensor, port in zip(mass, inertia, shapes.ports(x), strict=True)
    )


def _slices(shapes: BeamShapes) -> tuple[Array, Array]:
    """Positions of the mass points and lengths of their slices, m."""
    n = max((sum(m.direction == d for m in shapes.modes) for d in DIRECTIONS), default=0)
    positions, lengths = [], []
    places = sorted({*shapes.breaks, *(x for x, _ in shapes.data.ends.values())})
    for a, b in pairwise(places):
        nodes, weights = gauss_rule(max(4, int(np.ceil((3 * n + 4) * (b - a) / shapes.length))))
        positions.append(a + (b - a) * nodes)
        lengths.append((b - a) * weights)
    return np.concatenate(positions), np.concatenate(lengths)
