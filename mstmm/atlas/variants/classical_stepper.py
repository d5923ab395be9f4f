"""Steps of the classical method in the hands of a variant, which changes them as they go, or looks
at what a run does not tell."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...errors import NumericalFailure
from ...runtime.classical.forms import Moving, form_of
from ...runtime.classical.motions import States, start_of
from ...runtime.classical.parts import parts_of
from ...runtime.classical.records import Stepper, size_of
from ...runtime.classical.schemes import Scheme
from ...runtime.model.model import Model


class ClassicalSteps:
    """Steps from a model's start by Riccati on the classical matrices; `stepper` may be changed."""

    def __init__(self, model: Model, scheme: Scheme, iterations: int = 1) -> None:
        engine, (self.q, u) = model.looped, model.initial_state()
        parts = parts_of(engine.packed)
        moving = start_of(engine, parts, 0.0, self.q, u)
        names = [engine.body_name(part.hinge) for part in parts]
        gravity = np.array(engine.packed.system.gravity)
        form = form_of(parts, moving, gravity, names, size_of(parts))
        start = np.array([form.start(k, at) for k, at in enumerate(moving)])
        self.stepper = Stepper(engine, parts, form, scheme, start, iterations, product=False)
        self._states = States(engine.packed, parts, form, self.q)

    def advance(self, step: float, steps: int = 1) -> Array:
        """q (nq,) after so many more steps (s).  Raises NumericalFailure where one fails."""
        made = self.stepper.advance(steps, step)
        if len(made) < steps:
            raise NumericalFailure(f"a step fails by code {self.stepper.run.failure}")
        self.q = self._states.of(made)[0][-1]
        return self.q

    def moving(self) -> list[Moving]:
        """What the parts do now, in absolute coordinates, each as one of n = 1 times."""
        states, motions = self._states, self.stepper.motions
        return [states.form.moving(p, k, motions[k][None]) for k, p in enumerate(states.parts)]
