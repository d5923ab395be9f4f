"""Assembly with gaps weighted by the mobility of the bodies along each row.

Each row has a separate weight, so that a row along which bodies are light counts less.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import OpenLoop
from ...runtime.engine.loops.assembly import Assembly
from ...runtime.model.model import Model


class ByMasses(Assembly):
    """Assembly that minimises gaps weighted by the mobility of each row."""

    def _weighted(self) -> Array:
        super()._weighted()
        mobility = np.asarray(self.calls.mobility, float)
        for row, own in enumerate(mobility.tolist()):
            self.calls.records.scale(row, own)
        return 1.0 / mobility


def nearest(model: Model, q: Array, held: str, by_masses: bool) -> dict[str, float]:
    """Final hinge coordinates of the assembly of loops that cannot close, near q (nq,).

    The hinge `held` is fixed; for hinges of one coordinate.  ValueError if the loops close.
    """
    kind = ByMasses if by_masses else Assembly
    try:
        kind(model.looped, q, [held]).positions(q)
    except OpenLoop as open_loop:
        return {name: place[0] for name, place in open_loop.pose.items()}
    raise ValueError("the loops close")
