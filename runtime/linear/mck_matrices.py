"""M, C and K of a packed scene about a state: the residual of its equations, differentiated.

R(t, q, u, a) are the efforts that the accelerations a need beyond everything that acts (inverse
dynamics).  Along tangent increments, dq = N(q) dphi where qdot = N(q) u, it changes by

    dR = M da + C du + K dphi,      M = R_a,   C = R_u,   K = R_q N.

Every column is one directional derivative of the recursion, exact, O(bodies)
(derive/schedule/tangent_sweep.py); no difference is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.failure_source import find_nonfinite_derivative
from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import thread_tangent


@dataclass(frozen=True)
class State:
    """Time (s), coordinates (nq,), speeds (nu,) and accelerations (nu,) to make linear about."""

    t: float
    q: Array
    u: Array
    a: Array


@dataclass(frozen=True)
class Matrices:
    """M, C, K (n, n) of the n speeds that nobody imposes; rows N or N*m."""

    M: Array
    C: Array
    K: Array


def matrices(engine: LoopedEngine, state: State, free: Sequence[int]) -> Matrices:
    """The matrices of a packed scene.  NumericalFailure where the state cannot be evaluated."""
    found = thread_tangent(engine).matrices(state.t, state.q, state.u, state.a, free)
    if not np.isfinite(found).all():
        raise _no_slope(engine, state)
    return Matrices(*found)


def _no_slope(engine: LoopedEngine, state: State) -> NumericalFailure:
    cause = find_nonfinite_derivative(engine, state.t, state.q, state.u)
    return NumericalFailure(
        f"the scene is not linear near this state: {cause or 'a slope of its efforts is no number'}"
    )
