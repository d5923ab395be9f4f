"""States further along the motion of an operating point."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.display import abbreviate_names
from mstmm.errors import NumericalFailure, SceneError

from ...discontinuities.active_expressions import active_expressions
from ...engine.compiled_scene import speed_scales
from ...engine.state_evaluation.state_calls import move_steadily
from ...run.scene_system import SceneSystem
from ..mck_matrices import State

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ..linear_equations import LinearEquations


#: Advance of the fastest and of the slowest motion, rad or scene lengths: no two differ by a simple
#: fraction of a revolution, at which a periodic change would be missed.
_PHASES = (0.7, 1.9, 3.3)
#: Speeds that are rounding, relative to the fastest.
_STILL = 1e-9
#: Times (s) after the state at which dependence on time is checked, and about how many breaks of
#: inputs and expressions are used for further times.
_TIMES, _BREAKS = 1.0437 * np.geomspace(1e-3, 1e3, 19), 16
#: Latest time (s) after the state at which a motion is checked.
_LATEST = float(_TIMES[-1])
#: Stride of the times at which matrices are compared.
_SPARSE = 3
#: Motion (rad or characteristic scales) between projections of closed loops, and the largest number
#: of projections.
_STRIDE, _MAX_STRIDES = 0.1, 100


class LaterStates:
    """States further along the motion with the speeds of an operating point.

    Drives and loads are those of the later times.

    Attributes:
        all_states: all states; empty if nothing moves and nothing depends on time.
        compared_states: states at which matrices are compared.
        driven: speed indices of the drives that move at the operating point.
    """

    def __init__(self, linear: LinearEquations) -> None:
        self._linear, system = linear, linear.model.packed_scene.system
        state, first = linear.state, system.first_indices["u"]
        drives = [int(first[tree_index]) + k for tree_index, k in system.driven]
        self.driven = [k for k in drives if state.u[k] or state.udot[k]]
        turning = [*self._states_at(self._phases())]
        timed = (
            []
            if system.is_autonomous
            else [*self._states_at([*_TIMES, *self._times_between_breaks()])]
        )
        uniform = not self.driven or all(
            np.allclose(later_state.u[drives], state.u[drives], rtol=1e-12)
            and not later_state.udot[drives].any() for later_state in timed
        )  # fmt: skip
        fixed = not self.driven and all(not later_state.u[drives].any() for later_state in timed)
        depends = system.has_timed_loads or system.has_loops or not (uniform or fixed)
        self.all_states = [*turning, *timed]
        self.compared_states = [*turning, *(timed[::_SPARSE] if depends else ())]

    def equations(self) -> Iterator[LinearEquations]:
        """Yield the linear equations at the states `compared_states`."""
        for state in self.compared_states:
            yield equations_at(self._linear, state)

    @property
    def cause(self) -> str:
        """Cause of later changes, for messages."""
        model = self._linear.model
        hinges = dict.fromkeys(model.coordinate_layout.hinge_of_speed(k).name for k in self.driven)
        if hinges:
            return f"as drives move ({abbreviate_names(list(hinges))})"
        if self._linear.state.u.any():
            return "as the motion continues"
        return "as loads or drives change with time"

    def _phases(self) -> list[float]:
        """Times (s) after which motions have advanced by `_PHASES`, at most `_LATEST`."""
        linear = self._linear
        rates = np.abs(linear.state.u) / speed_scales(linear.model)
        rates = rates[rates > _STILL * rates.max(initial=0)]
        ends = {float(rates.max()), float(rates.min())} if len(rates) else set()
        times = [phase / rate for rate in sorted(ends, reverse=True) for phase in _PHASES]
        return list(dict.fromkeys(min(time, _LATEST) for time in times))

    def _times_between_breaks(self) -> list[float]:
        """Times (s) after the state, midway between breaks of expressions and inputs."""
        scene, t = self._linear.model.scene, self._linear.state.t
        inputs, breaks = scene.channels, set[float]()
        for active in active_expressions(scene):
            breaks.update(active.expression.time_breaks())
            breaks.update(knot for name in active.inputs for knot in inputs[name].knots)
        ahead = sorted(x - t for x in breaks if x > t)
        ahead = ahead[:: max(1, len(ahead) // _BREAKS)]
        ends = [0.0, *ahead, *([2 * ahead[-1]] if ahead else [])]
        return [(a + b) / 2 for a, b in pairwise(ends)]

    def _states_at(self, times: list[float]) -> Iterator[State]:
        """Yield the states at `times` (s) after the operating point that can be evaluated."""
        for dt in times:
            try:
                state = _state_after(self._linear, dt)
            except (NumericalFailure, SceneError):
                continue
            if state is not None:
                yield state


def equations_at(linear: LinearEquations, state: State) -> LinearEquations:
    """Linear equations at another state of the same motion."""
    loops, transform = linear.constrained_motion, linear.frame_transform
    loops = None if loops is None else loops.at_state(state)
    return replace(
        linear,
        state=state,
        compiled_state=None,
        constrained_motion=loops,
        rate_matrix=linear.rate_matrix if loops is None else loops.rate_matrix,
        frame_transform=None if transform is None else transform.advance(state.t - linear.state.t),
    )


def _state_after(linear: LinearEquations, dt: float) -> State | None:
    """State after dt (s); None if closed loops would need too many projections."""
    state, count = linear.state, 1
    if linear.constrained_motion is not None:
        rate = float((np.abs(state.u) / speed_scales(linear.model)).max(initial=0))
        count = max(1, int(np.ceil(dt * rate / _STRIDE)))
        if count > _MAX_STRIDES:
            return None
    q, u = state.q, state.u
    for k in range(count):
        q, u = _move_state(linear, state.t + dt * (k + 1) / count, q, u, dt / count)
    return State.moving(linear.model.looped, state.t + dt, q, u)


def _advance(
    model: CompiledScene, rate_t: float, t: float, q: Array, u: Array, dt: float
) -> tuple[Array, Array]:
    """State at t after dt (s) of steady motion, with the rates of `rate_t`, drives and loops."""
    engine = model.looped
    rates = engine.rates(rate_t, q, u, engine.start_memory())
    q = move_steadily(q, rates, dt, model.coordinate_layout.quaternions.tolist())
    whole = SceneSystem(engine).start(t, q, u)
    return whole[: model.nq], whole[model.nq : model.nq + model.nu]


def _move_state(
    linear: LinearEquations, t: float, q: Array, u: Array, dt: float
) -> tuple[Array, Array]:
    """State at t after a step dt that satisfies drives and loops and keeps the speeds of x."""
    model, loops = linear.model, linear.constrained_motion
    q, u = _advance(model, t, t, q, u, dt)
    if loops is not None and model.independent_speeds is not None:
        speed_indices = list(loops.independent_indices)
        motions = model.independent_speeds.motion_matrix(q, speed_indices)
        u = u + motions @ (linear.state.u[speed_indices] - u[speed_indices])
    return q, u


# --- one later state of a steady motion, to check for constant coefficients -----------------------

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
    dt = _AHEAD / float(np.abs(state.u).max())
    q, u = _advance(model, state.t, state.t + dt, state.q, state.u, dt)
    return State.moving(model.looped, state.t + dt, q, u)


def relative_difference(first: Array, second: Array) -> float:
    """Largest difference relative to the largest entry of the first array."""
    scale = float(np.abs(first).max(initial=0))
    return float(np.abs(first - second).max(initial=0)) / scale if scale else 0.0
