"""Linear models of closed loops whose loads stand still: K = N' R_q N without d(J' lambda)/dq.

Loads at a cut turn and move with their bodies, and what acts along a rod pulls it straight.  A tree
differentiated along the motions that its loops leave has nothing of that (F. Gonzalez, P. Masarati,
J. Cuadrado, M. A. Naya, Journal of Computational and Nonlinear Dynamics 12, 2017).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arrays import Array
from ...runtime.linear.loops.mechanism import mechanism_at
from ...runtime.linear.matrices import State
from ...runtime.model.model import Model


def squared_frequencies(model: Model) -> Array:
    """Of the mechanism at its start at rest, ascending, 1/s2."""
    q, u = model.initial_state()
    state = State(0.0, q, u, np.zeros(model.nu))
    whole = mechanism_at(model, state)
    assert whole is not None
    still = replace(whole, turned=np.zeros_like(whole.turned))
    found = still.matrices(still.tree, state)
    return np.asarray(np.sort(np.linalg.eigvals(np.linalg.solve(found.M, found.K)).real))
