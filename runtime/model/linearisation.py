"""Where a model is made linear: at its equilibrium, or at a state that is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..engine.characteristic_scales import speed_scales
from ..linear.input_channels import GROUND, Channel, input_channels, inputs_of
from ..linear.linear_model import Linear
from ..linear.loops.constrained_linearisation import mechanism_at, moving_at
from ..linear.mck_matrices import State, matrices
from ..linear.nonholonomic.admissible import has_speed_rows
from ..linear.nonholonomic.linear_model import nonholonomic_at
from ..linear.operating_point.friction import Amplitudes, dry_friction
from ..linear.validity import is_unsteady
from ..run.scene_system import SceneSystem
from ..run.start_state import initial_state
from .derivatives import Differentiation
from .equilibrium import equilibrium

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: A start this near to rest, in sizes of its coordinates, is one though nothing holds it there.
_AT_REST = 1e-9
#: How far coordinates of the equilibrium may be off, in sizes; see `Model.equilibrium`.
_TOLERANCE = 1e-10
#: The remedy where a scene that starts with speeds has no equilibrium.
_AT_START = (
    "the scene starts with speeds: for their motion give its state, "
    "linearize(*model.initial_state()), or --at-start on the command line"
)


class Lineariser:
    """Makes one model linear, at many states."""

    def __init__(self, model: CompiledScene) -> None:
        self._model = model
        system, layout = model.packed.system, model.layout
        twists = any(law.twist >= 0 for law in system.laws)
        #: Whether states are in order as they are given.
        self._settled = not (len(layout.quaternions) or system.driven or twists or system.closes)
        self._straight = all(h.straight for h in layout.hinges.values() if h.nu)

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
        pushes, others = self._inputs, self._ground
        if inputs is not None:
            pushes = input_channels(self._model, "inputs", inputs)
        if disturbances is not None:
            others = input_channels(self._model, "disturbances", disturbances)
        given = q is not None or u is not None
        q, u = self._state(q, u, t)
        at_speeds = None if given else partial(self._at_speeds, q, t)
        model, about, dry = self._model, None, dry_friction(self._model, u, friction)
        if model.freedom is None and not dry:
            about = model.slopes.at(t, q, u)
        if about is not None:
            turning = None if self._straight or not u.any() else about.G
            state = State(t, q, u, about.a)
            return Linear(model, state, pushes, others, turning, about, at_speeds=at_speeds)
        state = State(t, q, u, self._accelerations(t, q, u))
        bare = Linear(model, state, pushes, others, dry=dry, at_speeds=at_speeds)
        if model.freedom is not None:
            return self._of_mechanism(bare)
        return replace(bare, turning=self._turning(state))

    def _of_mechanism(self, bare: Linear) -> Linear:
        model, state, dry = self._model, bare.state, bare.dry
        if state.u.any() and has_speed_rows(model):
            return nonholonomic_at(bare, self._slopes)
        if not state.u.any():
            found = replace(bare, mechanism=mechanism_at(model, state, dry))
            if not is_unsteady(found):
                return found
        loops = moving_at(model, state, self._slopes, dry=dry)
        turning = None if loops is None else loops.turning
        return replace(bare, turning=turning, mechanism=loops)

    def _at_speeds(self, q: Array, t: float, u: Array) -> Linear:
        """At the same place with speeds u (nu,), without inputs."""
        return self(q, u, t, (), ())

    @cached_property
    def _inputs(self) -> tuple[Channel, ...]:
        return input_channels(self._model, "inputs", inputs_of(self._model))

    @cached_property
    def _ground(self) -> tuple[Channel, ...]:
        return input_channels(self._model, "disturbances", GROUND)

    def _state(self, q: Array | None, u: Array | None, t: float) -> tuple[Array, Array]:
        """The state that is given with its drives, or rest."""
        model = self._model
        speeds = np.zeros(model.nu) if u is None else u
        if q is None:
            q = _rest(model, t) if u is None else initial_state(model)[0]
        if self._settled:
            return q, speeds
        whole = SceneSystem(model.looped).start(t, q, speeds)
        return whole[: model.nq], whole[model.nq : model.nq + model.nu]

    def _accelerations(self, t: float, q: Array, u: Array) -> Array:
        """Refuses a state that has none."""
        engine = self._model.looped
        memory = engine.start_memory()
        return engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None])[1][0]

    def _turning(self, state: State) -> Array | None:
        """See `Linear.turning`; exact."""
        model = self._model
        if self._straight or not state.u.any():
            return None
        found = self._differentiation.turning(state.q, state.u, state.t)
        return np.asarray(found[np.ix_(model.free_speeds, model.free_speeds)])

    def _slopes(self, state: State) -> dict[str, Array]:
        """Exact slopes of the accelerations, by the names of `Derivatives`."""
        of = np.array([[state.t]]), state.q[None], state.u[None], np.zeros((1, self._model.nu))
        return {name: found[0] for name, found in self._differentiation.at(*of).items()}

    @cached_property
    def _differentiation(self) -> Differentiation:
        return Differentiation(self._model, ())


def _rest(model: CompiledScene, t: float) -> Array:
    """The equilibrium, or the start where it is at rest though nothing holds it there."""
    start, speeds = initial_state(model)
    try:
        return np.asarray(equilibrium(model, start, t, _TOLERANCE))
    except NumericalFailure as failure:
        q = SceneSystem(model.looped).start(t, start, np.zeros(model.nu))
        if not _at_rest(model, q[: model.nq], t):
            if speeds[list(model.free_speeds)].any():
                raise NumericalFailure(f"{failure}; {_AT_START}") from None
            raise
        return q[: model.nq]


def _at_rest(model: CompiledScene, q: Array, t: float) -> bool:
    """Whether what is missing at a state is rounding beside the stiffness that there is."""
    free, still, engine = list(model.free_speeds), np.zeros(model.nu), model.looped
    state = State(t, q, still, still)
    efforts = engine.inverse_dynamics(t, q, still, still, engine.start_memory())
    loops = mechanism_at(model, state)
    if loops is not None:
        free, missing = list(loops.places), loops.ways.T @ efforts
        stiffness = loops.matrices(loops.tree, state).K
    else:
        missing, stiffness = efforts[free], matrices(engine, state, free).K
    sizes = speed_scales(model)[free]
    missing, stiffness = missing * sizes, stiffness * np.outer(sizes, sizes)
    scale = float(np.abs(stiffness).max(initial=0))
    return float(np.abs(missing).max(initial=0)) <= _AT_REST * scale
