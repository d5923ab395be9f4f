"""Linearisation of a model about its equilibrium or a given state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.compiled_scene import speed_scales
from ..linear.constrained_linearisation import mechanism_at, mechanism_in_motion
from ..linear.input_channels import GROUND, Channel, input_channels, inputs_of
from ..linear.linear_model import Linear
from ..linear.mck_matrices import State, matrices
from ..linear.nonholonomic_model import nonholonomic_at
from ..linear.nonholonomic_perturbations import has_speed_rows
from ..linear.operating_point.friction import Amplitudes, dry_friction
from ..linear.validity import is_unsteady
from ..run.scene_system import SceneSystem
from ..run.start_state import initial_state
from .derivatives import Differentiation
from .equilibrium import equilibrium

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: Relative residual up to which a start counts as at rest though it has no unique equilibrium.
_AT_REST = 1e-9
#: Tolerance of the equilibrium in characteristic scales; see `Model.equilibrium`.
_TOLERANCE = 1e-10
#: Remedy if a scene that starts with speeds has no equilibrium.
_START_REMEDY = (
    "the scene starts with speeds: for their motion give its state, "
    "linearize(*model.initial_state()), or --at-start on the command line"
)


class Lineariser:
    """Linearisation of one model about any number of states."""

    def __init__(self, model: CompiledScene) -> None:
        self._model = model
        system, layout = model.packed_scene.system, model.coordinate_layout
        twists = any(law.twist >= 0 for law in system.laws)
        #: Whether any given state is consistent, without drives, loops or unit quaternions.
        self._is_consistent = not (
            len(layout.quaternions) or system.driven or twists or system.has_loops
        )
        self._has_rate_speeds = all(h.rates_are_speeds for h in layout.hinges.values() if h.nu)

    def __call__(
        self,
        q: Array | None,
        u: Array | None,
        t: float,
        inputs: Sequence[str] | None,
        disturbances: Sequence[str] | None,
        friction: Amplitudes = None,
    ) -> Linear:
        """See `Model.linearize`."""
        v_channels, w_channels = self._inputs, self._ground
        if inputs is not None:
            v_channels = input_channels(self._model, "inputs", inputs)
        if disturbances is not None:
            w_channels = input_channels(self._model, "disturbances", disturbances)
        is_given = q is not None or u is not None
        q, u = self._operating_point(q, u, t)
        at_speeds = None if is_given else partial(self._at_speed, q, t)
        model, equations, dry = self._model, None, dry_friction(self._model, u, friction)
        if model.independent_speeds is None and not dry:
            equations = model.compiled_linearisation.evaluate(t, q, u)
        if equations is not None:
            turning = None if self._has_rate_speeds or not u.any() else equations.G
            state = State(t, q, u, equations.a)
            channels = v_channels, w_channels
            return Linear(
                model, state, *channels, turning, equations, equations_at_speeds=at_speeds
            )
        state = State(t, q, u, self._accelerations(t, q, u))
        bare = Linear(model, state, v_channels, w_channels, dry=dry, equations_at_speeds=at_speeds)
        if model.independent_speeds is not None:
            return self._mechanism_model(bare)
        return replace(bare, rate_matrix=self._rate_matrix(state))

    def _mechanism_model(self, bare: Linear) -> Linear:
        model, state, dry = self._model, bare.state, bare.dry
        if state.u.any() and has_speed_rows(model):
            return nonholonomic_at(bare, self._acceleration_slopes)
        if not state.u.any():
            linear = replace(bare, constrained_motion=mechanism_at(model, state, dry))
            if not is_unsteady(linear):
                return linear
        loops = mechanism_in_motion(model, state, self._acceleration_slopes, dry=dry)
        turning = None if loops is None else loops.rate_matrix
        return replace(bare, rate_matrix=turning, constrained_motion=loops)

    def _at_speed(self, q: Array, t: float, u: Array) -> Linear:
        """Linear model about the same q with speeds u (nu,), without inputs."""
        return self(q, u, t, (), ())

    @cached_property
    def _inputs(self) -> tuple[Channel, ...]:
        return input_channels(self._model, "inputs", inputs_of(self._model))

    @cached_property
    def _ground(self) -> tuple[Channel, ...]:
        return input_channels(self._model, "disturbances", GROUND)

    def _operating_point(self, q: Array | None, u: Array | None, t: float) -> tuple[Array, Array]:
        """Given state, with consistent drives and loops, or the equilibrium."""
        model = self._model
        speeds = np.zeros(model.nu) if u is None else u
        if q is None:
            q = _equilibrium_or_start(model, t) if u is None else initial_state(model)[0]
        if self._is_consistent:
            return q, speeds
        y = SceneSystem(model.looped).start(t, q, speeds)
        return y[: model.nq], y[model.nq : model.nq + model.nu]

    def _accelerations(self, t: float, q: Array, u: Array) -> Array:
        """Accelerations (nu,) of a state; raises NumericalFailure if it has none."""
        engine = self._model.looped
        memory = engine.start_memory()
        return engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None])[1][0]

    def _rate_matrix(self, state: State) -> Array | None:
        """Exact `Linear.turning`; None if coordinate rates are the speeds."""
        model = self._model
        if self._has_rate_speeds or not state.u.any():
            return None
        matrix = self._differentiation.rate_matrix(state.q, state.u, state.t)
        return np.asarray(matrix[np.ix_(model.free_speed_indices, model.free_speed_indices)])

    def _acceleration_slopes(self, state: State) -> dict[str, Array]:
        """Exact derivatives of the accelerations by the names of `Derivatives`."""
        of = np.array([[state.t]]), state.q[None], state.u[None], np.zeros((1, self._model.nu))
        return {name: found[0] for name, found in self._differentiation.evaluate(*of).items()}

    @cached_property
    def _differentiation(self) -> Differentiation:
        return Differentiation(self._model, ())


def _equilibrium_or_start(model: CompiledScene, t: float) -> Array:
    """Equilibrium (nq,), or the start if it is at rest without a unique equilibrium."""
    start, speeds = initial_state(model)
    try:
        return np.asarray(equilibrium(model, start, t, _TOLERANCE))
    except NumericalFailure as failure:
        q = SceneSystem(model.looped).start(t, start, np.zeros(model.nu))
        if not _is_at_rest(model, q[: model.nq], t):
            if speeds[list(model.free_speed_indices)].any():
                raise NumericalFailure(f"{failure}; {_START_REMEDY}") from None
            raise
        return q[: model.nq]


def _is_at_rest(model: CompiledScene, q: Array, t: float) -> bool:
    """Whether the residual efforts of a state are rounding, relative to its stiffness."""
    free, zeros, engine = list(model.free_speed_indices), np.zeros(model.nu), model.looped
    state = State(t, q, zeros, zeros)
    efforts = engine.inverse_dynamics(t, q, zeros, zeros, engine.start_memory())
    loops = mechanism_at(model, state)
    if loops is not None:
        free, missing = list(loops.independent_indices), loops.motion_basis.T @ efforts
        stiffness = loops.matrices(loops.tree, state).K
    else:
        missing, stiffness = efforts[free], matrices(engine, state, free).K
    scales = speed_scales(model)[free]
    missing, stiffness = missing * scales, stiffness * np.outer(scales, scales)
    scale = float(np.abs(stiffness).max(initial=0))
    return float(np.abs(missing).max(initial=0)) <= _AT_REST * scale
