"""M, C and K of a packed scene about a state: derivatives of the residual of its equations.

R(t, q, u, a) are the efforts that the accelerations a require in addition to all applied loads
(inverse dynamics).  For tangent increments, dq = N(q) dphi where qdot = N(q) u,

    dR = M da + C du + K dphi,      M = R_a,   C = R_u,   K = R_q N.

Each column is one exact directional derivative of the recursion, O(bodies)
(derive/schedule/tangent_sweep.py), not a finite difference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.failure_messages import find_nonfinite_derivative
from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import thread_tangent


@dataclass(frozen=True)
class State:
    """Operating point: time (s), coordinates (nq,), speeds (nu,) and accelerations (nu,)."""

    t: float
    q: Array
    u: Array
    udot: Array


@dataclass(frozen=True)
class Matrices:
    """M, C, K (n, n) of the n speeds without prescribed motion; rows in N or N*m."""

    M: Array
    C: Array
    K: Array


def matrices(engine: LoopedEngine, state: State, free: Sequence[int]) -> Matrices:
    """Matrices of a packed scene; NumericalFailure if the state cannot be evaluated."""
    values = thread_tangent(engine).matrices(state.t, state.q, state.u, state.udot, free)
    if not np.isfinite(values).all():
        raise _no_slope(engine, state)
    return Matrices(*values)


def _no_slope(engine: LoopedEngine, state: State) -> NumericalFailure:
    cause = find_nonfinite_derivative(engine, state.t, state.q, state.u)
    return NumericalFailure(
        "the scene cannot be linearised at this state: "
        f"{cause or 'a derivative of its efforts is not finite'}"
    )
