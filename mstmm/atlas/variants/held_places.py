"""Steps of the classical method linearised at their start: the predictor y* = y_n."""

from __future__ import annotations

from ...arrays import Array
from ...runtime.classical.forms import AUXILIARY, AXES, RATE, SPEED
from ...runtime.classical.schemes import newmark
from ...runtime.model.model import Model
from .classical_stepper import ClassicalSteps

#: Trapezoidal rule, which needs no acceleration at the start of a step except the auxiliary one.
_SCHEME = newmark(0.5)


def end_of(model: Model, step: float, steps: int, iterations: int = 1) -> Array:
    """q (nq,) after `steps` steps (s) of the trapezoidal rule from the start.

    The stepper predicts with the accelerations of its motions, and then discards them.  Those set
    here predict that no body moves.  Raises NumericalFailure if a step fails.
    """
    run = ClassicalSteps(model, _SCHEME, iterations)
    for _ in range(steps):
        _hold(run.stepper.motions, step)
        run.advance(step)
    return run.q


def _hold(motions: Array, step: float) -> None:
    """Set accelerations with which the rule predicts the start of the step as its end."""
    speed, auxiliary = motions[:, SPEED:RATE], motions[:, AUXILIARY:AXES]
    motions[:, RATE:AUXILIARY] = -(speed / step + (0.5 - _SCHEME.beta) * auxiliary) / _SCHEME.beta
