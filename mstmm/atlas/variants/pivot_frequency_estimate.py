"""Estimate of the fastest motion of a chain of bodies from the pivots of the sweep."""

from __future__ import annotations

import numpy as np

from ...runtime.model.model import Model


def fastest_rate(model: Model) -> float:
    """|lambda| (1/s) at the start of a chain: root of the largest k/D of a hinge.

    k is the stiffness of the hinge and D the inertia by which the sweep divides, that of the
    outboard bodies, as if the inboard side did not move.
    """
    q, u = model.initial_state()
    inertia = model.mass_matrix(q)
    stiffness = -inertia @ model.derivatives(q, u).q
    pivots = np.diag(np.linalg.cholesky(inertia[::-1, ::-1]))[::-1] ** 2
    return float(np.sqrt(np.max(np.diag(stiffness) / pivots)))
