"""Spectral radius due to laws and modes at a state, matrix-free in O(bodies).

Laws, springs, loads and modes have a stiffness K and a damping C.  The largest eigenvalues k of
M^-1 K and c of M^-1 C are found by a few power iterations in the norm of M.  The estimate is the
larger root of s^2 + c s + k = 0, as if both belonged to the same motion.  Inertial terms (spin,
geometry) are omitted: they are the motion itself, which the steps must resolve in any case.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import Scene

from ..engine.jacobian import eigenvalues
from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import TangentMatrix
from ..packing.scene_packing import reject_qr_steps

#: Power iterations; the choice of their start vector includes a further one.
_ITERATIONS = 4

#: Number of speeds, those with the largest diagonal entries, tried as start vectors.
_CANDIDATES = 64

#: Number of state components up to which the eigenvalues of the full Jacobian are computed.
_MAX_DENSE = 24

#: Product of a vector (nu,) with K or C.
Operator = Callable[[Array], Array]


def fastest_possible(scene: Scene) -> float:
    """Largest |lambda| (1/s) of any spring or damper on the smallest inertia.

    0 without springs and dampers, inf if an inertia is zero.  An inexpensive bound that decides
    whether to compute the fastest motion.
    """
    laws = [table.law for table in (*scene.hinge, *(x for c in scene.chain for x in c.hinge))]
    max_k = max([k for law in laws for k in law.stiffness], default=0.0)
    max_k = max([max_k, *(spring.law.stiffness for spring in scene.spring)])
    max_k = max([max_k, *(k for bushing in scene.bushing for k in bushing.stiffest)])
    max_c = max([c for law in laws for c in law.damping], default=0.0)
    max_c = max([max_c, *(spring.law.damping for spring in scene.spring)])
    max_c = max([max_c, *(c for bushing in scene.bushing for c in bushing.most_damped)])
    if not (max_k > 0 or max_c > 0):
        return 0.0
    tables = (*scene.body, *(table for chain in scene.chain for table in chain.body))
    min_inertia = min((min(body.mass, max(body.inertia)) for body in tables), default=0.0)
    if not min_inertia > 0:
        return math.inf
    return max(math.sqrt(max(max_k, 0.0) / min_inertia), max_c / min_inertia)


def fastest_at_start(engine: LoopedEngine, t: float, q: Array, u: Array) -> float:
    """Largest |lambda| (1/s) at a state (nq,), (nu,) with nothing released.

    Small scenes use the eigenvalues of the full Jacobian, which costs less there.  Raises
    SceneError for scenes that implicit methods do not support, NumericalFailure where the state
    cannot be evaluated.
    """
    reject_qr_steps(engine.packed)
    memory, y = engine.start_memory(), np.concatenate([q, u])
    if len(y) > _MAX_DENSE:
        return FastestMode(engine, memory).rate(t, q, u)
    try:
        return float(np.abs(eigenvalues(engine, t, y, memory)[0]).max(initial=0.0))
    except np.linalg.LinAlgError:
        raise NumericalFailure(f"eigenvalues at t = {t:.9g} s: Jacobian not finite") from None


class FastestMode:
    """Estimate of the fastest motion of one scene; `memory` is read at each call."""

    def __init__(self, engine: LoopedEngine, memory: Array) -> None:
        self.engine, self.memory = engine, memory
        inertia = engine.inertia_only
        self._full, self._inertia = TangentMatrix(engine, memory), TangentMatrix(inertia, memory)
        self._kinematics = TangentMatrix(inertia, memory)  # `rates` overwrites a tangent's state
        packed = engine.packed
        self._modes = [
            (packed.layout.modal[name].u_slice, body.K, body.D)
            for name, body in packed.flexible.items()
        ]

    def rate(self, t: float, q: Array, u: Array) -> float:
        """|lambda| (1/s) at a state q (nq,), u (nu,): a lower bound, for most scenes within 10 %.

        Raises NumericalFailure where the state cannot be evaluated.
        """
        nq, nu = self.engine.nq, self.engine.nu
        if not nu:
            return 0.0
        q, u, zero = np.array(q), np.array(u), np.zeros(nu)
        for tangent in (self._full, self._inertia):
            tangent.residual(t, q, u, zero)

        def stiffness(x: Array) -> Array:
            efforts = self._effort_change(self._kinematics.rates(q, x), zero)
            for speeds, K, _ in self._modes:
                efforts[speeds] += K @ x[speeds]
            return efforts

        def damping(x: Array) -> Array:
            efforts = self._effort_change(np.zeros(nq), x)
            for speeds, _, D in self._modes:
                efforts[speeds] += D @ x[speeds]
            return efforts

        k, c = self._max_eigenvalue(q, stiffness), self._max_eigenvalue(q, damping)
        discriminant = c * c / 4 - k
        return math.sqrt(k) if discriminant < 0.0 else c / 2 + math.sqrt(discriminant)

    def _effort_change(self, d_q: Array, d_u: Array) -> Array:
        """Change of the efforts (nu,) of laws, springs and loads along a direction."""
        zero = np.zeros(self.engine.nu)
        return self._full.slope(0.0, d_q, d_u, zero) - self._inertia.slope(0.0, d_q, d_u, zero)

    def _max_eigenvalue(self, q: Array, operator: Operator) -> float:
        """Largest |eigenvalue| of M^-1 A, A = `operator`; M^-1 y has the M-norm sqrt(y.M^-1 y)."""
        x, norm = self._start_vector(q, operator), 0.0
        for _ in range(_ITERATIONS if x.any() else 0):
            y = operator(x)
            z = self._solve_mass(q, y[None])[0]
            norm = math.sqrt(max(float(z @ y), 0.0))
            if not norm:
                return 0.0
            x = z / norm
        return norm

    def _start_vector(self, q: Array, operator: Operator) -> Array:
        """M^-1 e_j of M-norm 1, for the speed j with the largest A_jj (M^-1)_jj.

        One product with random signs estimates all A_jj; it is exact for a diagonal A.
        """
        nu = self.engine.nu
        signs = _random_signs(nu)
        diagonal = np.abs(signs * operator(signs))
        speeds = np.argsort(-diagonal, kind="stable")[:_CANDIDATES]
        unit_rows = np.zeros((len(speeds), nu))
        unit_rows[np.arange(len(speeds)), speeds] = 1.0
        solutions = self._solve_mass(q, unit_rows)
        mobility = solutions[np.arange(len(speeds)), speeds]
        best = int(np.argmax(diagonal[speeds] * mobility))
        if not diagonal[speeds[best]] * mobility[best] > 0.0:
            return np.zeros(nu)
        return np.asarray(solutions[best] / math.sqrt(mobility[best]))

    def _solve_mass(self, q: Array, rows: Array) -> Array:
        return self.engine.solve(q, rows, self.memory)


@cache
def _random_signs(count: int) -> Array:
    """Fixed sequence (count,) of pseudo-random 1 and -1."""
    return np.random.default_rng(0).choice([-1.0, 1.0], count)
