"""Rosenbrock steps without the safeguards of a run.

Their stages are those of a run: its residual and tangent, accelerations as unknowns.  The table may
be one that runs do not offer.  The time derivative of the equations (Hairer, Wanner, Solving
Ordinary Differential Equations II, 1996, IV.7), and the accelerations of the start, may be left
out.  Errors are measured by the usual norm (IV.8), which weights errors of speeds separately, not
by the displacement within the step.
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.engine.tangent_matrix import TangentMatrix
from ...runtime.integrate.steppers import get
from ...runtime.integrate.steppers.implicit_methods import Rosenbrock
from ...runtime.model.model import Model

#: Safety factor of the step size, and limits of its change.
_SAFETY_FACTOR, _MIN_STEP_FACTOR, _MAX_STEP_FACTOR = 0.9, 0.2, 6.0


class BareRosenbrock:
    """Rosenbrock steps on states (3, n): coordinates, speeds (their rates), accelerations."""

    def __init__(
        self,
        model: Model,
        method: str | Rosenbrock,
        time_slope: bool = True,
        accelerations: Array | None = None,
    ) -> None:
        table = get(method) if isinstance(method, str) else method
        assert isinstance(table, Rosenbrock) and table.E is not None
        self._table, self._estimate = table, table.E[:-1]
        self._base, self._stage = TangentMatrix(model.looped), TangentMatrix(model.looped)
        self._time_coefficients = table.d if time_slope else np.zeros_like(table.d)
        q, u = model.initial_state()
        udot = model.accelerations(q, u) if accelerations is None else accelerations
        self._start = np.array([q, u, udot])

    def fixed_step_states(self, step: float, steps: int) -> Array:
        """States (steps + 1, 3, n) with a fixed step (s)."""
        states = [self._start]
        for number in range(steps):
            states.append(self._step(number * step, step, states[-1])[0])
        return np.array(states)

    def adaptive_step_count(self, t_end: float, rtol: float, atol: float, most: int) -> int:
        """Number of adaptive steps to t_end (s), including rejected ones.

        Raises NumericalFailure if it exceeds `most`.
        """
        t, y, h, exponent = 0.0, self._start, rtol * t_end, 1.0 / (self._table.error_order + 1)
        for number in range(1, most + 1):
            h = min(h, t_end - t)
            new_state, error = self._step(t, h, y)
            norm = self.size(h, error / (atol + rtol * np.maximum(np.abs(y), np.abs(new_state))))
            if norm < 1.0:
                t, y = t + h, new_state
            if t >= t_end:
                return number
            h *= (
                min(_MAX_STEP_FACTOR, max(_MIN_STEP_FACTOR, _SAFETY_FACTOR * norm**-exponent))
                if norm > 0.0
                else _MAX_STEP_FACTOR
            )
        raise NumericalFailure(f"more than {most} steps")

    def size(self, h: float, error: Array) -> float:
        """Norm of errors (3, n) of a step of h (s), relative to their tolerances; limit 1."""
        return float(np.sqrt(np.mean(error[:2] ** 2)))

    def _step(self, t: float, h: float, y: Array) -> tuple[Array, Array]:
        """State at t + h and its error estimate."""
        table, tangent, zeros = self._table, self._base, np.zeros_like(y[0])
        s = 1.0 / (table.gamma * h)
        tangent.residual(t, *y)
        time_derivative = tangent.slope(1.0, zeros, zeros, zeros)
        tangent.factor(s, s)
        stages = np.zeros((table.n_stages, *y.shape))
        for i in range(1, table.n_stages):
            stage_state = y + np.tensordot(table.A[i], stages, 1)
            right = (
                -self._stage.residual(t + table.C[i] * h, *stage_state)
                - self._time_coefficients[i] * h * time_derivative
            )
            q, u = stage_state[1:] + np.tensordot(table.second[i], stages[:, :2], 1) / h
            x = tangent.solve(right, q / s, -u)
            stages[i] = (x + q) / s, x, s * x - u
        end = y + np.tensordot(table.B, stages, 1)
        return end, np.tensordot(self._estimate, stages, 1)
