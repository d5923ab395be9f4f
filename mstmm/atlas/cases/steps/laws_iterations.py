"""Iteration with a tangent matrix of hinge laws only."""

from __future__ import annotations

from ....runtime.integrate.methods import Implicit
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import simulate_to_end
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import hanging_rod
from ...variants import laws_newton

STEP, STEPS, MAX_ITERATIONS = 0.01, 20, 100


def _iterations_with_laws(rate: float) -> float:
    """`rate` is the step times the angular frequency of the rod."""
    return laws_newton.mean_iterations(hanging_rod(rate / STEP), STEP, STEPS, MAX_ITERATIONS)


def _iterations_with_choice(rate: float) -> float:
    method = Implicit("newmark", tangent="laws")
    run = simulate_to_end(hanging_rod(rate / STEP), STEPS * STEP, method, STEP)
    statistics = run.statistics
    assert statistics is not None
    return statistics.iterations / statistics.steps


CASE = CaseDefinition(
    name="laws-iterations",
    title="Iteration with hinge laws only: stiffness due to loads",
    cause="Where a tangent matrix neglects weight, spin and preload, every iteration leaves a "
    "quarter of (step times frequency) squared of the error: from 2 on it diverges. Runs start "
    "with the derivatives of hinge laws, which cost little, observe the convergence of the "
    "iteration, and use the exact tangent where it is slow.",
    parameter="step times angular frequency of a hanging rod",
    unit="",
    low=0.03,
    high=20.0,
    scale=LOG_SCALE,
    measured="iterations per step",
    limit=float(MAX_ITERATIONS),
    method=MethodDefinition("newmark, hinge laws only", _iterations_with_laws),
    remedy=MethodDefinition("newmark, exact where laws are slow", _iterations_with_choice),
    reach=30.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (simplified "
    "iteration); Kelley, Solving Nonlinear Equations with Newton's Method, 2003, ch. 2",
)
