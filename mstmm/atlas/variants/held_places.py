"""Steps of the classical method that are linearised where they begin: the predictor y* = y_n."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import NumericalFailure
from ...runtime.classical.forms import AUXILIARY, AXES, RATE, SPEED, form_of
from ...runtime.classical.motions import States, start_of
from ...runtime.classical.parts import parts_of
from ...runtime.classical.records import Stepper, size_of
from ...runtime.classical.schemes import newmark
from ...runtime.model.model import Model

#: The trapezoidal rule, which asks for no acceleration of the step's start but the auxiliary one.
_SCHEME = newmark(0.5)


def end_of(model: Model, step: float, steps: int, iterations: int = 1) -> Array:
    """q (nq,) after so many steps (s) of the trapezoidal rule from the start.

    The stepper predicts with the accelerations of its motions, and forgets them.  Those handed over
    here leave every body where it is.  Raises NumericalFailure where a step fails.
    """
    engine, (q, u) = model.looped, model.initial_state()
    parts = parts_of(engine.packed)
    moving = start_of(engine, parts, 0.0, q, u)
    names = [engine.body_name(part.hinge) for part in parts]
    gravity = np.array(engine.packed.system.gravity)
    form = form_of(parts, moving, gravity, names, size_of(parts))
    start = np.array([form.start(k, at) for k, at in enumerate(moving)])
    stepper = Stepper(engine, parts, form, _SCHEME, start, iterations, product=False)
    states = States(engine.packed, parts, form, q)
    for number in range(steps):
        _hold(stepper.motions, step)
        made = stepper.advance(1, step)
        if not len(made):
            raise NumericalFailure(f"step {number} fails by code {stepper.run.failure}")
        q = states.of(made)[0][-1]
    return q


def _hold(motions: Array, step: float) -> None:
    """Accelerations with which the rule ends a step where it began."""
    speed, auxiliary = motions[:, SPEED:RATE], motions[:, AUXILIARY:AXES]
    motions[:, RATE:AUXILIARY] = -(speed / step + (0.5 - _SCHEME.beta) * auxiliary) / _SCHEME.beta
