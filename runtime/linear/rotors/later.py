"""Linear equations a little further along a steady motion, for comparison."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ...engine.state_evaluation.steady_motion import move_steadily
from ...run.scene_system import SceneSystem
from ..mck_matrices import State

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Matrices that still count as the same, in parts.
SAME = 1e-6
#: How far matrices are compared along the motion, in rad or sizes.
_AHEAD = 0.1


def later(linear: LinearEquations) -> LinearEquations:
    """The equations a little further along the motion."""
    state, loops = ahead(linear), linear.mechanism
    loops = None if loops is None else loops.at(state)
    turning = linear.turning if loops is None else loops.turning
    carrying = linear.carrying
    if carrying is not None:
        carrying = carrying.later(state.t - linear.state.t)
    return replace(
        linear, state=state, about=None, mechanism=loops, turning=turning, carrying=carrying
    )


def ahead(linear: LinearEquations) -> State:
    """The state a little further along the motion, with the same speeds."""
    model, state = linear.model, linear.state
    engine, memory = model.looped, model.looped.start_memory()
    dt = _AHEAD / float(np.abs(state.u).max())
    rates = engine.rates(state.t, state.q, state.u, memory)
    quaternions = [int(k) for group in model.layout.groups for k in group.quaternions()]
    q = move_steadily(state.q, rates, dt, quaternions)
    whole = SceneSystem(engine).start(state.t + dt, q, state.u)
    q, u = whole[: model.nq], whole[model.nq : model.nq + model.nu]
    _, a = engine.accelerations(state.t + dt, q[None].copy(), u[None].copy(), memory[None])
    return State(state.t + dt, q, u, a[0])


def apart(one: Array, other: Array) -> float:
    """Largest difference, in parts of the largest entry."""
    scale = float(np.abs(one).max(initial=0))
    return float(np.abs(one - other).max(initial=0)) / scale if scale else 0.0
