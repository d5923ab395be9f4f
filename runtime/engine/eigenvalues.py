"""Eigenvalues of the Jacobian of a scene's right-hand side at a state.

The Jacobian is computed by central differences.  For a hinge with stiffness k, damping c and
effective inertia mu the largest eigenvalue is about c/mu + sqrt(k/mu).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from .looped_engine import LoopedEngine

Complex = NDArray[np.complex128]

#: Maximum number of state components for a dense solution; for larger states a Krylov method
#: computes only the fastest motion.
MAX_DENSE_STATES = 160


def fastest_eigenvalue(
    engine: LoopedEngine, t: float, y: Array, memory: Array
) -> tuple[complex, Complex]:
    """Eigenvalue (1/s) and eigenvector (nq + nu,) of the fastest motion without pure growth."""
    values, vectors = eigenvalues(engine, t, y, memory)
    k = int(np.abs(values).argmax())
    return complex(values[k]), vectors[:, k]


def eigenvalues(engine: LoopedEngine, t: float, y: Array, memory: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (k,), 1/s, and eigenvectors (nq + nu, k) of the Jacobian at a state.

    Eigenvalues of monotonic growth, and positive real parts of the others, are set to 0.  For large
    scenes only the fastest motion is computed.
    """
    n = len(y)
    sizes = np.maximum(1e-6, 1e-6 * np.abs(y))
    if n <= MAX_DENSE_STATES:
        values, vectors = np.linalg.eig(
            _central_differences(engine, t, y, memory, np.diag(sizes)) / sizes
        )
    else:
        values, vectors = _fastest_by_krylov(engine, t, y, memory)
    is_growing = values.real > np.abs(
        values.imag
    )  # physical growth, not a stability limit of a method
    limited_values = np.minimum(values.real, 0.0) + 1j * values.imag
    return np.where(is_growing, 0.0, limited_values).astype(np.complex128), vectors


def _central_differences(
    engine: LoopedEngine, t: float, y: Array, memory: Array, moves: Array
) -> Array:
    """Central differences (n, k) of the right-hand side along the columns of `moves` (n, k)."""
    rates = _right_hand_sides(engine, t, np.concatenate([y + moves.T, y - moves.T]), memory)
    half = len(rates) // 2
    return np.asarray((rates[:half] - rates[half:]).T / 2)


def _right_hand_sides(engine: LoopedEngine, t: float, states: Array, memory: Array) -> Array:
    """Right-hand sides (k, n) of states (k, n)."""
    q, u = (np.ascontiguousarray(x) for x in np.split(states, [engine.nq], axis=1))
    return np.hstack(engine.accelerations(t, q, u, np.tile(memory, (len(states), 1))))


def _fastest_by_krylov(
    engine: LoopedEngine, t: float, y: Array, memory: Array
) -> tuple[Complex, Complex]:
    """Eigenvalue and eigenvector of the fastest motion, from Jacobian-vector products."""
    from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigs

    n, rates_at_state = len(y), _right_hand_sides(engine, t, y[None], memory)[0]

    def product(vector: Any) -> Array:
        size = float(np.linalg.norm(vector)) or 1.0
        step = 1e-6 * np.sqrt(n) * np.asarray(vector, dtype=float).reshape(1, n) / size
        change = (
            _right_hand_sides(engine, t, y + step, memory)[0] - rates_at_state
        )  # 1 per cent accuracy is sufficient
        return np.asarray(change * size / (1e-6 * np.sqrt(n)))

    operator = LinearOperator((n, n), matvec=product, dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(n)
    zero_result = np.zeros(1, dtype=np.complex128), start[:, None].astype(np.complex128)
    try:
        values, vectors = eigs(
            operator, k=1, which="LM", tol=1e-2, maxiter=40, v0=start, ncv=min(n, 12)
        )
    except ArpackNoConvergence as error:
        values, vectors = error.eigenvalues, error.eigenvectors
    except ArpackError:  # all rates are zero: no step is too long
        return zero_result
    return (values, vectors) if len(values) else zero_result
