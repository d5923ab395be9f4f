"""Assembly with gaps weighted by the mobility of the bodies along each row.

Each row has a separate weight, so that a row along which bodies are light counts less.
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...errors import LoopClosureError
from ...runtime.engine.loops.assembly import Assembly
from ...runtime.model.model import Model


class MassWeightedAssembly(Assembly):
    """Assembly that minimises gaps weighted by the mobility of each row."""

    def _weighted(self) -> Array:
        super()._weighted()
        mobility = np.asarray(self.calls.mobility, float)
        for row, row_mobility in enumerate(mobility.tolist()):
            self.calls.records.scale(row, row_mobility)
        return 1.0 / mobility


def nearest_pose(model: Model, q: Array, held: str, by_masses: bool) -> dict[str, float]:
    """Final hinge coordinates of the assembly of loops that cannot close, near q (nq,).

    The hinge `held` is fixed; for hinges of one coordinate.  ValueError if the loops close.
    """
    assembly_class = MassWeightedAssembly if by_masses else Assembly
    try:
        assembly_class(model.looped, q, [held]).positions(q)
    except LoopClosureError as error:
        return {name: coordinates[0] for name, coordinates in error.pose.items()}
    raise ValueError("the loops close")
