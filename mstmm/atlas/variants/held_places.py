"""Steps of the classical method that are linearised where they begin: the predictor y* = y_n."""

from __future__ import annotations

from ...arrays import Array
from ...runtime.classical.forms import AUXILIARY, AXES, RATE, SPEED
from ...runtime.classical.schemes import newmark
from ...runtime.model.model import Model
from .classical_stepper import ClassicalSteps

#: The trapezoidal rule, which asks for no acceleration of the step's start but the auxiliary one.
_SCHEME = newmark(0.5)


def end_of(model: Model, step: float, steps: int, iterations: int = 1) -> Array:
    """q (nq,) after so many steps (s) of the trapezoidal rule from the start.

    The stepper predicts with the accelerations of its motions, and forgets them.  Those handed over
    here leave every body where it is.  Raises NumericalFailure where a step fails.
    """
    run = ClassicalSteps(model, _SCHEME, iterations)
    for _ in range(steps):
        _hold(run.stepper.motions, step)
        run.advance(step)
    return run.q


def _hold(motions: Array, step: float) -> None:
    """Accelerations with which the rule ends a step where it began."""
    speed, auxiliary = motions[:, SPEED:RATE], motions[:, AUXILIARY:AXES]
    motions[:, RATE:AUXILIARY] = -(speed / step + (0.5 - _SCHEME.beta) * auxiliary) / _SCHEME.beta
