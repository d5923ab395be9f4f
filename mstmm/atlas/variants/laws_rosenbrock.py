"""Rosenbrock steps of any table with a tangent of inertia and hinge-law derivatives only.

Runs reject this for tables that lose their order by it.  For tables whose order does not depend on
the tangent (W-methods: Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7;
Rang, Angermann, BIT 45, 2005) these are the steps of a run: stages evaluate their accelerations.
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.engine.tangent_matrix import TangentMatrix
from ...runtime.model.model import Model
from .bare_rosenbrock import BareRosenbrock


class LawTangentSteps(BareRosenbrock):
    """Steps for autonomous scenes whose speeds are the rates of their coordinates."""

    def __init__(self, model: Model, method: str) -> None:
        super().__init__(model, method)
        self._evaluate, self._laws = model.accelerations, TangentMatrix(model.looped)

    def _step(self, t: float, h: float, y: Array) -> tuple[Array, Array]:
        table = self._table
        s = 1.0 / (table.gamma * h)
        self._laws.residual(t, *y)
        self._laws.factor_laws(s, s)
        stages, zeros = np.zeros((table.n_stages, *y.shape)), np.zeros_like(y[0])
        for i in range(1, table.n_stages):
            q, u, _ = y + np.tensordot(table.A[i], stages, 1)
            slopes = np.array([u, self._evaluate(q, u)])
            slopes += np.tensordot(table.second[i], stages[:, :2], 1) / h
            speed_part = slopes[1] / s
            x = self._laws.solve_laws(zeros, (speed_part + slopes[0]) / s, speed_part)
            speed_stage = x / s + speed_part
            stages[i] = (speed_stage + slopes[0]) / s, speed_stage, x
        end = y + np.tensordot(table.B, stages, 1)
        end[2] = self._evaluate(end[0], end[1])
        return end, np.tensordot(self._estimate, stages, 1)
