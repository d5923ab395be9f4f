"""M, C and K of a scene as operators: products and solutions in O(bodies) without matrices.

    Z(s) = s^2 M + s C + K

is the tangent matrix of an implicit step with acceleration s^2 x and speed s x, so that the same
sweep factors both.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import TangentMatrix
from .mck_matrices import State


class Pencil:
    """Operators M, C, K on the n free speeds of a scene at rest at a state.  Not thread-safe."""

    def __init__(self, engine: LoopedEngine, state: State, free: list[int]) -> None:
        self.tangent, self.free = TangentMatrix(engine), np.array(free, dtype=np.int64)
        self._indices = slice(None) if len(free) == engine.nu else self.free
        self.state, self._zeros = state, np.zeros(engine.nu)
        self.tangent.allow_negative()
        self._no_q = np.zeros(engine.nq)
        self._inertia = engine.inertia_only
        self._rest_efforts = self._required_efforts(self._zeros)
        self._factored: tuple[float, float] | None = None
        self._set_state()

    def __len__(self) -> int:
        return len(self.free)

    def _set_state(self) -> None:
        state = self.state
        self.tangent.residual(state.t, state.q, state.u, state.udot)

    def _full(self, x: Array) -> Array:
        whole = self._zeros.copy()
        whole[self._indices] = np.ravel(x)
        return whole

    def mass(self, x: Array) -> Array:
        """Product M x: the inertia efforts at rest."""
        return self._required_efforts(self._full(x)) - self._rest_efforts

    def _required_efforts(self, a: Array) -> Array:
        engine, state = self._inertia, self.state
        memory = self.tangent.memory
        return engine.inverse_dynamics(state.t, state.q, self._zeros, a, memory)[self._indices]

    def damping(self, x: Array) -> Array:
        """Product C x."""
        return self.tangent.slope(0.0, self._no_q, self._full(x), self._zeros)[self._indices]

    def stiffness(self, x: Array) -> Array:
        """Product K x."""
        moved = self.tangent.rates(self.state.q, self._full(x))
        self._set_state()
        return self.tangent.slope(0.0, moved, self._zeros, self._zeros)[self._indices]

    def skew(self) -> float:
        """Relative asymmetry of K along two random directions."""
        x, y = np.random.default_rng(0).standard_normal((2, len(self)))
        first, second = self.stiffness(x), self.stiffness(y)
        size = float(np.linalg.norm(first) * np.linalg.norm(y))
        return abs(float(y @ first - x @ second)) / size if size else 0.0

    def factor(self, square: float, rate: float = 0.0) -> None:
        """Factor square M + rate C + K; NumericalFailure if it is singular."""
        if self._factored != (square, rate):
            self._factored = None
            self._set_state()
            self.tangent.factor(square, 1.0, 0.0, rate)
            self._factored = square, rate

    def solve(self, r: Array) -> Array:
        """Solution x of (square M + rate C + K) x = r with the last factorisation."""
        return self.tangent.solve(self._full(r))[self._indices]
