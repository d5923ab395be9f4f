"""M, C and K of a packed scene about a state: the residual of its equations, differentiated.

R(t, q, u, a) are the efforts that the accelerations a need beyond everything that acts (inverse
dynamics).  Along tangent increments, dq = N(q) dphi where qdot = N(q) u, it changes by

    dR = M da + C du + K dphi,      M = R_a,   C = R_u,   K = R_q N.

Every column is one directional derivative of the recursion, exact, O(bodies)
(derive/schedule/tangent.py); no difference is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.arrays import Array

from ..engine.engine import Engine
from ..engine.tangent import Tangent


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


def matrices(engine: Engine, state: State, free: list[int]) -> Matrices:
    """The matrices of a packed scene.  NumericalFailure where the state cannot be evaluated."""
    tangent, nu = Tangent(engine), engine.nu
    units = np.eye(nu)[free]
    moves = [tangent.rates(state.q, unit) for unit in units]
    tangent.residual(state.t, state.q, state.u, state.a)
    no_q, no_u = np.zeros(engine.nq), np.zeros(nu)

    def columns(directions: list[tuple[Array, Array, Array]]) -> Array:
        found = [tangent.slope(0.0, *direction)[free] for direction in directions]
        return np.array(found).reshape(len(free), len(free)).T

    return Matrices(
        M=columns([(no_q, no_u, unit) for unit in units]),
        C=columns([(no_q, unit, no_u) for unit in units]),
        K=columns([(move, no_u, no_u) for move in moves]),
    )
