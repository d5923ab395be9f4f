"""Linear equations at a later state of a steady motion, to check for constant coefficients."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ...engine.state_evaluation.state_calls import move_steadily
from ...run.scene_system import SceneSystem
from ..mck_matrices import State
from ..operating_point.later_states import equations_at

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Relative tolerance for equal matrices.
SAME = 1e-6
#: Travel along the motion to the later state, in rad or characteristic scales.
_AHEAD = 0.1


def later_equations(linear: LinearEquations) -> LinearEquations:
    """Linear equations at the later state of the motion."""
    return equations_at(linear, later_state(linear))


def later_state(linear: LinearEquations) -> State:
    """Later state of the motion, at the same speeds."""
    model, state = linear.model, linear.state
    engine, memory = model.looped, model.looped.start_memory()
    dt = _AHEAD / float(np.abs(state.u).max())
    rates = engine.rates(state.t, state.q, state.u, memory)
    quaternions = [int(k) for group in model.coordinate_layout.groups for k in group.quaternions()]
    q = move_steadily(state.q, rates, dt, quaternions)
    whole = SceneSystem(engine).start(state.t + dt, q, state.u)
    q, u = whole[: model.nq], whole[model.nq : model.nq + model.nu]
    _, a = engine.accelerations(state.t + dt, q[None].copy(), u[None].copy(), memory[None])
    return State(state.t + dt, q, u, a[0])


def relative_difference(first: Array, second: Array) -> float:
    """Largest difference relative to the largest entry of the first array."""
    scale = float(np.abs(first).max(initial=0))
    return float(np.abs(first - second).max(initial=0)) / scale if scale else 0.0
