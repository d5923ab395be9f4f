"""Steps of the classical method for variants that modify them or read internal results."""

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
    """Classical steps from a model's start, by Riccati; `stepper` may be modified."""

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
        """Advance by `steps` steps (s) and return q (nq,).  NumericalFailure if one fails."""
        made = self.stepper.advance(steps, step)
        if len(made) < steps:
            raise NumericalFailure(f"a step fails with code {self.stepper.run.failure}")
        self.q = self._states.of(made)[0][-1]
        return self.q

    def moving(self) -> list[Moving]:
        """Current motion of each part in absolute coordinates, as arrays over one time."""
        states, motions = self._states, self.stepper.motions
        return [states.form.moving(p, k, motions[k][None]) for k, p in enumerate(states.parts)]
