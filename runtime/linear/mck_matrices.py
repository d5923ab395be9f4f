"""M, C and K of a packed scene about a state: derivatives of the residual of its equations.

R(t, q, u, a) are the efforts that the accelerations a require in addition to all applied loads
(inverse dynamics).  For tangent increments, dq = N(q) dphi where qdot = N(q) u,

    dR = M da + C du + K dphi,      M = R_a,   C = R_u,   K = R_q N.

Each column is one exact directional derivative of the recursion, O(bodies)
(derive/schedule/tangent_sweep.py), not a finite difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.failure_messages import find_nonfinite_derivative
from ..engine.looped_engine import LoopedEngine
from ..engine.tangent_matrix import TangentMatrix, thread_tangent


@dataclass(frozen=True)
class State:
    """Operating point: time (s), coordinates (nq,), speeds (nu,) and accelerations (nu,)."""

    t: float
    q: Array
    u: Array
    udot: Array

    @classmethod
    def moving(cls, engine: LoopedEngine, t: float, q: Array, u: Array) -> State:
        """State of q and u with the accelerations that follow from its loads."""
        memory = engine.start_memory()[None]
        _, a = engine.accelerations(t, q[None].copy(), u[None].copy(), memory)
        return cls(t, q, u, a[0])


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


# --- operators: products and solutions in O(bodies) without matrices ------------------------------
#
#     Z(s) = s^2 M + s C + K
#
# is the tangent matrix of an implicit step with acceleration s^2 x and speed s x, so that the same
# sweep factors both.


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


# --- transformation from the rotating to the fixed frame ------------------------------------------


@dataclass(frozen=True)
class FrameTransform:
    """Transformation to the fixed frame at one time: y = T x, T' = W T, T W = W T.

    `rotation` is T (n, n), `rates` is W (n, n), 1/s.
    """

    rotation: Array
    rates: Array

    def advance(self, dt: float) -> FrameTransform:
        """Transformation dt (s) later."""
        from scipy.linalg import expm  # here, because a run without linear model needs no SciPy

        return FrameTransform(self.rotation @ expm(self.rates * dt), self.rates)

    def matrices(self, given: Matrices) -> Matrices:
        """Matrices M, C, K of y from those of x."""
        back, w = np.linalg.inv(self.rotation), self.rates
        m, c, k = (back.T @ matrix @ back for matrix in (given.M, given.C, given.K))
        return Matrices(m, c - 2 * m @ w, k - c @ w + m @ w @ w)

    def input_matrix(self, columns: Array) -> Array:
        """Input columns (n, inputs) of y from those of x."""
        return np.asarray(np.linalg.solve(self.rotation.T, columns))

    def rows(self, orders: dict[int, Array], column_indices: list[int]) -> dict[int, Array]:
        """Output rows of y (outputs, nu), by power of s, from those of x at `column_indices`."""
        back, rotated = np.linalg.inv(self.rotation), {k: wide.copy() for k, wide in orders.items()}
        for order in sorted(orders, reverse=True):
            own = orders[order][:, column_indices] @ back
            rotated[order][:, column_indices] += own - orders[order][:, column_indices]
            for lower, factor in _BELOW[order]:
                rows = rotated.setdefault(lower, np.zeros_like(orders[order]))
                rows[:, column_indices] += (
                    factor * own @ np.linalg.matrix_power(self.rates, order - lower)
                )
        return rotated


#: Lower-order terms of x^(order) = T^-1 (y^(order) + ...): (order of y, factor of a power of W).
_BELOW = {0: (), 1: ((0, -1.0),), 2: ((1, -2.0), (0, 1.0))}


# --- symbolic matrices ----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class SymbolicLinearModel:
    """M x'' + C x' + K x = V v + W w with SymPy matrices; rows and units as in `Linear`.

    Attributes:
        M, C, K, V, W: `sympy.ImmutableMatrix` in the kept symbols; columns as in `Linear`.
        symbols: `sympy.Symbol` by name.
        symbol_values: value of each symbol in the scene or state, SI units; `M.subs(numbers)` is
            the matrix of the linear model.
        coordinate_names: names of x.
        input_names, disturbance_names: names of v and w.
    """

    M: Any = field(repr=False)
    C: Any = field(repr=False)
    K: Any = field(repr=False)
    V: Any = field(repr=False)
    W: Any = field(repr=False)
    symbols: Mapping[str, Any]
    symbol_values: Mapping[Any, float]
    coordinate_names: tuple[str, ...]
    input_names: tuple[str, ...] = ()
    disturbance_names: tuple[str, ...] = ()
