"""The fastest motion of a row of bodies by the pivots of the sweep."""

from __future__ import annotations

import numpy as np

from ...runtime.model.model import Model


def fastest(model: Model) -> float:
    """|lambda| (1/s) at the start of a scene whose hinges follow each other outwards: the largest
    k/D of a hinge, k its stiffness and D the inertia that the sweep divides by there, which is of
    what lies outboard, as if the inboard side stood still."""
    q, u = model.initial_state()
    inertia = model.mass_matrix(q)
    stiffness = -inertia @ model.derivatives(q, u).q
    pivots = np.diag(np.linalg.cholesky(inertia[::-1, ::-1]))[::-1] ** 2
    return float(np.sqrt(np.max(np.diag(stiffness) / pivots)))
