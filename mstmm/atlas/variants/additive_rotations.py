"""Steps of the classical method that add finite rotations like vectors.

A body rotates by T(psi) times the change of psi, with the tangent operator T of the exponential;
here the matrices have 1 instead of T.
"""

from __future__ import annotations

from ...array_validation import Array
from ...runtime.classical.integration_schemes import generalised_alpha
from ...runtime.model.model import Model
from .classical_stepper import ClassicalSteps


def final_coordinates(model: Model, step: float, steps: int, radius: float) -> Array:
    """q (nq,) after `steps` steps (s) of generalised-alpha, with one solution per step.

    `radius` is the spectral radius at infinity.  Raises NumericalFailure if a step fails.
    """
    run = ClassicalSteps(model, generalised_alpha(radius))
    run.stepper.run.turning = 0
    return run.advance(step, steps)
