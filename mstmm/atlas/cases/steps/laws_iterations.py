"""Iteration with a tangent matrix of hinge laws only."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import hanging_rod
from ...variants import laws_newton

STEP, STEPS, MOST = 0.01, 20, 100


def _by_laws(rate: float) -> float:
    """`rate` is the step times the angular frequency of the rod."""
    return laws_newton.iterations(hanging_rod(rate / STEP), STEP, STEPS, MOST)


def _watched(rate: float) -> float:
    run = simulated(hanging_rod(rate / STEP), STEPS * STEP, "newmark", STEP, tangent="laws")
    counted = run.statistics
    assert counted is not None
    return counted.iterations / counted.steps


CASE = Definition(
    name="laws-iterations",
    title="Iteration with hinge laws only: stiffness due to loads",
    why="Where a tangent matrix neglects weight, spin and preload, every iteration leaves a "
    "quarter of (step times frequency) squared of the error: from 2 on it diverges. Runs start "
    "with the derivatives of hinge laws, which cost little, observe the convergence of the "
    "iteration, and use the exact tangent where it is slow.",
    parameter="step times angular frequency of a hanging rod", unit="", low=0.03, high=20.0,
    scale=LOG, measured="iterations per step", limit=float(MOST),
    method=Method("newmark, hinge laws only", _by_laws),
    remedy=Method("newmark, exact where laws are slow", _watched), reach=30.0,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (simplified "
    "iteration); Kelley, Solving Nonlinear Equations with Newton's Method, 2003, ch. 2",
)  # fmt: skip
