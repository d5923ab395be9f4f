"""Steps of the classical method that take a change of a rotation vector for a turn in space.

A body turns by T(psi) times the change of psi, T the tangent operator of the exponential; here T
is left out of the matrices, 1 in its place.
"""

from __future__ import annotations

from ...arrays import Array
from ...runtime.classical.schemes import generalised_alpha
from ...runtime.model.model import Model
from .classical_stepper import ClassicalSteps


def end_of(model: Model, step: float, steps: int, radius: float) -> Array:
    """q (nq,) after so many steps (s) of generalised-alpha with this radius, one solution a step.

    Raises NumericalFailure where a step fails.
    """
    run = ClassicalSteps(model, generalised_alpha(radius))
    run.stepper.run.turning = 0
    return run.advance(step, steps)
