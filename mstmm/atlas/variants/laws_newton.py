"""Steps of the trapezoidal rule, iterated with inertia and hinge-law derivatives only.

Runs observe the convergence of such an iteration, and use the exact tangent where it is slow.
"""

from __future__ import annotations

import numpy as np

from ...errors import NumericalFailure
from ...runtime.engine.tangent_matrix import TangentMatrix
from ...runtime.model.model import Model

#: Change of speeds at which an iteration has converged, relative to that of the step.
_CONVERGENCE_TOLERANCE = 1e-8


def mean_iterations(model: Model, step: float, steps: int, max_count: int) -> float:
    """Mean number of iterations per step, for `steps` steps (s) from the start.

    For scenes whose speeds are the rates of their coordinates.  Raises NumericalFailure if a step
    needs more than `max_count`.
    """
    tangent, iteration_count, rate = TangentMatrix(model.looped), 0, 2.0 / step
    q, u = model.initial_state()
    a = model.accelerations(q, u)
    for number in range(1, steps + 1):
        q, u, speed = q + step * u + step**2 / 2 * a, u + step * a, u
        for _ in range(max_count):
            iteration_count += 1
            residual = tangent.residual(number * step, q, u, a)
            tangent.factor_laws(rate, rate)
            change = tangent.solve_laws(-residual)
            q, u, a = q + change / rate**2, u + change / rate, a + change
            if np.abs(change).max() <= _CONVERGENCE_TOLERANCE * rate * np.abs(u - speed).max():
                break
        else:
            raise NumericalFailure(f"step {number}: not converged after {max_count} iterations")
    return iteration_count / steps
