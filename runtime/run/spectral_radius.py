"""The fastest motion that laws and modes cause at a state, without a matrix: O(bodies).

Laws, springs, loads and modes have slopes K and C by coordinates and speeds.  The largest
eigenvalues of M^-1 K and M^-1 C, each by a few power iterations in the norm of M, are those of one
motion or of two; s^2 + c s + k = 0 has the faster one as its larger root.  What inertia itself adds
(spin, geometry) is left out: it is the motion that is wanted, and steps have to follow it anyway.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from mstmm.scene import Scene

from ..engine.eigenvalues import eigenvalues
from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import TangentMatrix
from ..packing.qr_sweep import reject_qr_steps

#: Power iterations; the first one is in the choice of their start.
_ITERATIONS = 4

#: Speeds among which the start is chosen: those on which slopes are largest.
_CANDIDATES = 64

#: Coordinates and speeds together up to which all motions are looked at.
_FEW = 24

Operator = Callable[[Array], Array]


def may_be_fast(scene: Scene, rate: float) -> bool:
    """Whether springs and dampers are stiff enough, beside the smallest inertia, for a motion of
    that |lambda| (1/s); only if they are is it worth while to compute it."""
    return fastest_possible(scene) > rate


def fastest_possible(scene: Scene) -> float:
    """|lambda| (1/s) of the stiffest spring or damper beside the smallest inertia; 0 without any,
    inf for inertia of nothing."""
    laws = [table.law for table in (*scene.hinge, *(x for c in scene.chain for x in c.hinge))]
    stiffest = max([k for law in laws for k in law.stiffness], default=0.0)
    stiffest = max([stiffest, *(spring.law.stiffness for spring in scene.spring)])
    stiffest = max([stiffest, *(k for one in scene.bushing for k in one.stiffest)])
    damped = max([c for law in laws for c in law.damping], default=0.0)
    damped = max([damped, *(spring.law.damping for spring in scene.spring)])
    damped = max([damped, *(c for one in scene.bushing for c in one.most_damped)])
    if not (stiffest > 0 or damped > 0):
        return 0.0
    tables = (*scene.body, *(table for chain in scene.chain for table in chain.body))
    least = min((min(body.mass, max(body.inertia)) for body in tables), default=0.0)
    if not least > 0:
        return math.inf
    return max(math.sqrt(max(stiffest, 0.0) / least), damped / least)


def fastest_at_start(engine: LoopedEngine, t: float, q: Array, u: Array) -> float:
    """|lambda| (1/s) at a state (nq,), (nu,) with nothing released: of few components by all
    motions, which costs less than to look for one.

    Raises SceneError for scenes that implicit steps cannot follow, NumericalFailure where the state
    cannot be evaluated.
    """
    reject_qr_steps(engine.packed)
    memory, y = engine.start_memory(), np.concatenate([q, u])
    if len(y) > _FEW:
        return FastestMode(engine, memory).rate(t, q, u)
    try:
        return float(np.abs(eigenvalues(engine, t, y, memory)[0]).max(initial=0.0))
    except np.linalg.LinAlgError:
        raise NumericalFailure(f"the motions at t = {t:.9g} s are not finite") from None


class FastestMode:
    """The estimate for one scene.  `memory` is read whenever it is asked for."""

    def __init__(self, engine: LoopedEngine, memory: Array) -> None:
        self.engine, self.memory = engine, memory
        inertia = engine.inertia_alone
        self._whole, self._inertia = TangentMatrix(engine, memory), TangentMatrix(inertia, memory)
        self._motion = TangentMatrix(inertia, memory)  # rates spoil the state of a tangent
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
        q, u, still = np.array(q), np.array(u), np.zeros(nu)
        for tangent in (self._whole, self._inertia):
            tangent.residual(t, q, u, still)

        def stiffness(x: Array) -> Array:
            found = self._slope(self._motion.rates(q, x), still)
            for at, K, _ in self._modes:
                found[at] += K @ x[at]
            return found

        def damping(x: Array) -> Array:
            found = self._slope(np.zeros(nq), x)
            for at, _, D in self._modes:
                found[at] += D @ x[at]
            return found

        k, c = self._largest(q, stiffness), self._largest(q, damping)
        aperiodic = c * c / 4 - k
        return math.sqrt(k) if aperiodic < 0.0 else c / 2 + math.sqrt(aperiodic)

    def _slope(self, d_q: Array, d_u: Array) -> Array:
        """What laws, springs and loads change along a direction, without inertia."""
        still = np.zeros(self.engine.nu)
        return self._whole.slope(0.0, d_q, d_u, still) - self._inertia.slope(0.0, d_q, d_u, still)

    def _largest(self, q: Array, slope: Operator) -> float:
        """The largest |eigenvalue| of M^-1 slope: M^-1 y has the norm (y . M^-1 y)^(1/2) of M."""
        x, size = self._start(q, slope), 0.0
        for _ in range(_ITERATIONS if x.any() else 0):
            y = slope(x)
            z = self._solved(q, y[None])[0]
            size = math.sqrt(max(float(z @ y), 0.0))
            if not size:
                return 0.0
            x = z / size
        return size

    def _start(self, q: Array, slope: Operator) -> Array:
        """M^-1 e of the speed with the largest slope times (M^-1)_jj, of norm 1; slopes by one
        product, exact where each speed has its own."""
        nu = self.engine.nu
        signs = _signs(nu)
        own = np.abs(signs * slope(signs))
        places = np.argsort(-own, kind="stable")[:_CANDIDATES]
        columns = np.zeros((len(places), nu))
        columns[np.arange(len(places)), places] = 1.0
        answers = self._solved(q, columns)
        mobile = answers[np.arange(len(places)), places]
        best = int(np.argmax(own[places] * mobile))
        if not own[places[best]] * mobile[best] > 0.0:
            return np.zeros(nu)
        return np.asarray(answers[best] / math.sqrt(mobile[best]))

    def _solved(self, q: Array, columns: Array) -> Array:
        return self.engine.solve(q, columns, self.memory)


@cache
def _signs(count: int) -> Array:
    """(count,) of 1 and -1 without order, always the same."""
    return np.random.default_rng(0).choice([-1.0, 1.0], count)
