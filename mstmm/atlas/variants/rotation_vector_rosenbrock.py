"""Rosenbrock steps on rotation vectors, optionally with an incomplete tangent matrix.

Within a step an attitude is q exp(theta), and theta' = w + theta x w / 2 + theta x (theta x w) / 12
(H. Munthe-Kaas, BIT 38 (1998) 92-111).  At theta = 0 the derivative of theta' by theta is that of
theta x w / 2, though theta vanishes there (E. Hairer, G. Wanner, Solving Ordinary Differential
Equations II, 1996, IV.7: the order of a table requires the whole Jacobian).
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.integrate.steppers import get
from ...runtime.integrate.steppers.implicit_methods import Rosenbrock
from ...runtime.model.model import Model
from .naive_rotation_vectors import rotate, rotation_vector_rate

#: Step of the finite differences, rad and rad/s.
_DIFFERENCE_STEP = 1e-5


def final_attitude(model: Model, step: float, steps: int, method: str, slope: bool) -> Array:
    """q (4,) of a body on a ball hinge after `steps` steps (s) of a Rosenbrock table.

    `slope`: whether the tangent has the derivative of the rotation vector's rate by that vector.
    """
    table = get(method)
    assert isinstance(table, Rosenbrock)
    attitude, speeds = model.initial_state()

    def rates(y: Array) -> Array:
        theta, u = y[:3], y[3:]
        return np.append(
            rotation_vector_rate(theta, u), model.accelerations(rotate(attitude, theta), u)
        )

    for _ in range(steps):
        start = np.append(np.zeros(3), speeds)
        tangent = np.transpose([
            (rates(start + d) - rates(start - d)) / (2 * _DIFFERENCE_STEP)
            for d in _DIFFERENCE_STEP * np.eye(6)
        ])  # fmt: skip
        if not slope:
            tangent[:3, :3] = 0.0
        left = np.eye(6) / (table.gamma * step) - tangent
        stages = np.zeros((table.n_stages, 6))
        for i in range(1, table.n_stages):
            right = rates(start + table.A[i] @ stages) + table.second[i] @ stages / step
            stages[i] = np.linalg.solve(left, right)
        end = start + table.B @ stages
        attitude, speeds = rotate(attitude, end[:3]), end[3:]
    return attitude
