"""Assembly that measures gaps by how far loads along their rows move the bodies.

Each row has its own weight, so that a row along which bodies are light counts for less.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import OpenLoop
from ...runtime.engine.loops.assembly import Assembly
from ...runtime.model.model import Model


class ByMasses(Assembly):
    """Assembly whose least gap is that of rows in their own mobilities."""

    def _weighted(self) -> Array:
        super()._weighted()
        mobility = np.asarray(self.calls.mobility, float)
        for row, own in enumerate(mobility.tolist()):
            self.calls.records.scale(row, own)
        return 1.0 / mobility


def nearest(model: Model, q: Array, held: str, by_masses: bool) -> dict[str, float]:
    """Coordinates of the hinges where assembly of loops that nothing closes ends, near q (nq,) and
    with one hinge held; for hinges of one coordinate."""
    kind = ByMasses if by_masses else Assembly
    try:
        kind(model.looped, q, [held]).positions(q)
    except OpenLoop as open_loop:
        return {name: place[0] for name, place in open_loop.pose.items()}
    raise ValueError("the loops close")
