"""Steps of the classical method linearised at their start: the predictor y* = y_n."""

from __future__ import annotations

from ...array_validation import Array
from ...runtime.classical.integration_schemes import newmark
from ...runtime.classical.planar_and_spatial import AUXILIARY, AXES, RATE, SPEED
from ...runtime.model.model import Model
from .classical_stepper import ClassicalSteps

#: Trapezoidal rule, which needs no acceleration at the start of a step except the auxiliary one.
_SCHEME = newmark(0.5)


def final_coordinates(model: Model, step: float, steps: int, iterations: int = 1) -> Array:
    """q (nq,) after `steps` steps (s) of the trapezoidal rule from the start.

    The stepper predicts with the accelerations of its motions, and then discards them.  Those set
    here predict that no body moves.  Raises NumericalFailure if a step fails.
    """
    run = ClassicalSteps(model, _SCHEME, iterations)
    for _ in range(steps):
        _set_resting_predictor(run.stepper.motions, step)
        run.advance(step)
    return run.q


def _set_resting_predictor(motions: Array, step: float) -> None:
    """Set accelerations with which the rule predicts the start of the step as its end."""
    speed, auxiliary = motions[:, SPEED:RATE], motions[:, AUXILIARY:AXES]
    motions[:, RATE:AUXILIARY] = -(speed / step + (0.5 - _SCHEME.beta) * auxiliary) / _SCHEME.beta
