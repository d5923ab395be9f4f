"""Cases of steps with a tangent matrix of inertia and hinge-law derivatives only."""

from __future__ import annotations

from functools import cache

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.engine.tangent_matrix import TangentMatrix
from ...runtime.integrate.methods import Implicit
from ...runtime.model.model import Model
from ..case_definition import LOG_SCALE, CaseDefinition, MethodDefinition
from ..error_measures import relative_growth, simulate_to_end
from ..shared_scenes import elbow_with_spring, hanging_rod
from .steps_rosenbrock import BareRosenbrock

# --- laws-tangent ---------------------------------------------------------------------------------

STEP, GROWTH_STEPS = 0.01, 400


def _growth(rate: float, tangent: str) -> float:
    """`rate` is the step times the angular frequency of the rod."""
    method = Implicit("ros34pw2", tangent=tangent)
    return relative_growth(hanging_rod(rate / STEP), STEP, GROWTH_STEPS, method)


LAWS_TANGENT = CaseDefinition(
    name="laws-tangent",
    title="Tangent of hinge laws only: stiffness due to loads",
    cause="Weight, spin and preload make a motion stiff without any spring. A linearisation with "
    "the derivatives of springs and dampers only does not include that stiffness; a Rosenbrock "
    "method is then explicit in that direction. The exact tangent includes it.",
    parameter="step times angular frequency of a hanging rod", unit="", low=0.03, high=100.0,
    scale=LOG_SCALE,
    measured="largest over initial angle in 400 steps", limit=1.01,
    method=MethodDefinition("ros34pw2, tangent of laws", lambda rate: _growth(rate, "laws")),
    remedy=MethodDefinition("ros34pw2, exact tangent", lambda rate: _growth(rate, "exact")),
    reach=1e3,
    source="Rang, Angermann, BIT 45, 2005 (W-methods); Hairer, Wanner, Solving Ordinary "
    "Differential Equations II, 1996, IV.7",
)  # fmt: skip


# --- laws newton ----------------------------------------------------------------------------------
#
# Steps of the trapezoidal rule, iterated with inertia and hinge-law derivatives only.
#
# Runs observe the convergence of such an iteration, and use the exact tangent where it is slow.

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


# --- laws-iterations ------------------------------------------------------------------------------

STEPS, MAX_ITERATIONS = 20, 100


def _iterations_with_laws(rate: float) -> float:
    """`rate` is the step times the angular frequency of the rod."""
    return mean_iterations(hanging_rod(rate / STEP), STEP, STEPS, MAX_ITERATIONS)


def _iterations_with_choice(rate: float) -> float:
    method = Implicit("newmark", tangent="laws")
    run = simulate_to_end(hanging_rod(rate / STEP), STEPS * STEP, method, STEP)
    statistics = run.statistics
    assert statistics is not None
    return statistics.iterations / statistics.steps


LAWS_ITERATIONS = CaseDefinition(
    name="laws-iterations",
    title="Iteration with hinge laws only: stiffness due to loads",
    cause="Where a tangent matrix neglects weight, spin and preload, every iteration leaves a "
    "quarter of (step times frequency) squared of the error: from 2 on it diverges. Runs start "
    "with the derivatives of hinge laws, which cost little, observe the convergence of the "
    "iteration, and use the exact tangent where it is slow.",
    parameter="step times angular frequency of a hanging rod", unit="", low=0.03, high=20.0,
    scale=LOG_SCALE,
    measured="iterations per step", limit=float(MAX_ITERATIONS),
    method=MethodDefinition("newmark, hinge laws only", _iterations_with_laws),
    remedy=MethodDefinition("newmark, exact where laws are slow", _iterations_with_choice),
    reach=30.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (simplified "
    "iteration); Kelley, Solving Nonlinear Equations with Newton's Method, 2003, ch. 2",
)  # fmt: skip


# --- laws rosenbrock ------------------------------------------------------------------------------
#
# Rosenbrock steps of any table with a tangent of inertia and hinge-law derivatives only.
#
# Runs reject this for tables that lose their order by it. For tables whose order does not depend on
# the tangent (W-methods: Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7;
# Rang, Angermann, BIT 45, 2005) these are the steps of a run: stages evaluate their accelerations.


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


# --- laws-order -----------------------------------------------------------------------------------

T_END = 0.5


@cache
def _arm() -> tuple[Model, Array]:
    """Falling rods, and their exact angles at the end."""
    arm = elbow_with_spring(10.0, 0.2)
    return arm, simulate_to_end(arm, T_END, rtol=1e-12, atol=1e-14, output_times=[T_END]).q[-1]


def _rodas4_error(step: float) -> float:
    arm, exact = _arm()
    steps = round(T_END / step)
    angles = LawTangentSteps(arm, "rodas4").fixed_step_states(T_END / steps, steps)[-1, 0]
    return float(np.abs(angles - exact).max())


def _rodas4pw_error(step: float) -> float:
    arm, exact = _arm()
    method = Implicit("rodas4pw", tangent="laws")
    run = simulate_to_end(arm, T_END, method, T_END / round(T_END / step), output_times=[T_END])
    return float(np.abs(run.q[-1] - exact).max())


LAWS_ORDER = CaseDefinition(
    name="laws-order",
    title="Tangent of hinge laws only: the order of a table",
    cause="Most Rosenbrock tables need the exact tangent for their order. With the derivatives of "
    "springs and dampers only, which cost less, Rodas4 falls to first order, Rodas4P2 and Rodas5P "
    "to second; runs reject that. The tables of W-methods, ROS34PW2 and Rodas4PW, keep their order "
    "with any tangent.",
    parameter="length of a step", unit="s", low=2e-4, high=0.05, scale=LOG_SCALE,
    measured="error of the angles after 0.5 s, rad", limit=1e-5,
    method=MethodDefinition("rodas4, tangent of laws", _rodas4_error),
    remedy=MethodDefinition("rodas4pw, tangent of laws", _rodas4pw_error), reach=0.05,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.7; Rang, "
    "Angermann, BIT 45, 2005 (W-methods)",
)  # fmt: skip


CASES = (LAWS_TANGENT, LAWS_ITERATIONS, LAWS_ORDER)
