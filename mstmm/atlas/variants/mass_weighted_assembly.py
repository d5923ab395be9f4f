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

    def _compute_weights(self) -> Array:
        super()._compute_weights()
        mobility = np.asarray(self.calls.mobility, float)
        for row, row_mobility in enumerate(mobility.tolist()):
            self.calls.records.scale(row, row_mobility)
        return 1.0 / mobility


def nearest_pose(model: Model, q: Array, fixed_hinge: str, by_masses: bool) -> dict[str, float]:
    """Final hinge coordinates of the assembly of loops that cannot close, near q (nq,).

    The hinge `fixed_hinge` does not move; for hinges of one coordinate.  Raises ValueError if the
    loops close.
    """
    assembly_class = MassWeightedAssembly if by_masses else Assembly
    try:
        assembly_class(model.looped, q, [fixed_hinge]).positions(q)
    except LoopClosureError as error:
        return {name: coordinates[0] for name, coordinates in error.pose.items()}
    raise ValueError("nearest_pose: expected loops that cannot close, they close")
