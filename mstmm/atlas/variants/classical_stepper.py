"""Steps of the classical method for variants that modify them or read internal results."""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...errors import NumericalFailure
from ...runtime.classical.body_parts import build_parts
from ...runtime.classical.c_records import Stepper, scene_size
from ...runtime.classical.integration_schemes import Scheme
from ...runtime.classical.planar_and_spatial import PartMovement, select_form
from ...runtime.classical.state_conversion import StateConversion, start_movements
from ...runtime.model.model import Model


class ClassicalSteps:
    """Classical steps from the initial state of a model; `stepper` may be modified."""

    def __init__(self, model: Model, scheme: Scheme, iterations: int = 1) -> None:
        engine, (self.q, u) = model.looped, model.initial_state()
        parts = build_parts(engine.packed)
        motions = start_movements(engine, parts, 0.0, self.q, u)
        names = [engine.body_name(part.hinge) for part in parts]
        gravity = np.array(engine.packed.system.gravity)
        form = select_form(parts, motions, gravity, names, scene_size(parts))
        start = np.array([form.initial_motion(k, motion) for k, motion in enumerate(motions)])
        self.stepper = Stepper(engine, parts, form, scheme, start, iterations, product=False)
        self._states = StateConversion(engine.packed, parts, form, self.q)

    def advance(self, step: float, steps: int = 1) -> Array:
        """Advance by `steps` steps (s); return q (nq,).  NumericalFailure if a step fails."""
        states = self.stepper.advance(steps, step)
        if len(states) < steps:
            raise NumericalFailure(f"a step fails with code {self.stepper.run.failure}")
        self.q = self._states.convert(states)[0][-1]
        return self.q

    def part_movements(self) -> list[PartMovement]:
        """Current motion of each part in absolute coordinates, as arrays over one time."""
        states, motions = self._states, self.stepper.motions
        return [
            states.form.part_movement(p, k, motions[k][None]) for k, p in enumerate(states.parts)
        ]
