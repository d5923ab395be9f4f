"""Linear models of closed loops with frozen loads: K = N' R_q N without d(J' lambda)/dq.

Loads at a cut rotate and move with their bodies, and tension along a rod straightens it.  A tree
differentiated along the motions that its loops allow lacks that stiffness (F. Gonzalez, P.
Masarati, J. Cuadrado, M. A. Naya, Journal of Computational and Nonlinear Dynamics 12, 2017).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...array_validation import Array
from ...runtime.linear.loops.constrained_linearisation import mechanism_at
from ...runtime.linear.mck_matrices import State
from ...runtime.model.model import Model


def squared_frequencies(model: Model) -> Array:
    """Squared angular frequencies of the mechanism at its start at rest, ascending, 1/s^2."""
    q, u = model.initial_state()
    state = State(0.0, q, u, np.zeros(model.nu))
    mechanism = mechanism_at(model, state)
    assert mechanism is not None
    frozen = replace(mechanism, constraint_stiffness=np.zeros_like(mechanism.constraint_stiffness))
    matrices = frozen.matrices(frozen.tree, state)
    return np.asarray(np.sort(np.linalg.eigvals(np.linalg.solve(matrices.M, matrices.K)).real))
