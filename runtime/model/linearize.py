"""Where a model is made linear: at its equilibrium, or at a state that is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..engine.sizes import speed_sizes
from ..linear.channels import GROUND, channel, names_of
from ..linear.linear import Linear
from ..linear.matrices import State, matrices
from ..run.start import initial_state
from ..run.system import SceneSystem
from .derivatives import Differentiation
from .equilibrium import equilibrium

if TYPE_CHECKING:
    from ..engine.compiled import Compiled

#: A start this near to rest, in sizes of its coordinates, is one though nothing holds it there.
_AT_REST = 1e-9
#: How far coordinates of the equilibrium may be off, in sizes; see `Model.equilibrium`.
_TOLERANCE = 1e-10


def linearize(
    model: Compiled,
    q: Array | None,
    u: Array | None,
    t: float,
    inputs: Sequence[str],
    disturbances: Sequence[str] | None,
) -> Linear:
    """See `Model.linearize`."""
    pushes = tuple(channel(model, name) for name in names_of("inputs", inputs))
    named = GROUND if disturbances is None else names_of("disturbances", disturbances)
    others = tuple(channel(model, name) for name in named)
    state = _state(model, q, u, t)
    return Linear(model, state, pushes, others, _turning(model, state))


def _state(model: Compiled, q: Array | None, u: Array | None, t: float) -> State:
    """The state that is given with its drives, or rest; `accelerations` refuses what has none."""
    speeds = np.zeros(model.nu) if u is None else u
    if q is None:
        q = _rest(model, t) if u is None else initial_state(model)[0]
    whole = SceneSystem(model.looped).start(t, q, speeds)
    q, speeds = whole[: model.nq], whole[model.nq : model.nq + model.nu]
    engine, memory = model.looped, model.looped.start_memory()
    _, a = engine.accelerations(t, q[None].copy(), speeds[None].copy(), memory[None])
    return State(t, q, speeds, a[0])


def _rest(model: Compiled, t: float) -> Array:
    """The equilibrium, or the start where it is at rest though nothing holds it there."""
    start = initial_state(model)[0]
    try:
        return np.asarray(equilibrium(model, start, t, _TOLERANCE))
    except NumericalFailure:
        q = SceneSystem(model.looped).start(t, start, np.zeros(model.nu))
        if not _at_rest(model, q[: model.nq], t):
            raise
        return q[: model.nq]


def _at_rest(model: Compiled, q: Array, t: float) -> bool:
    """Whether what is missing at a state is rounding beside the stiffness that there is."""
    free, still = list(model.free_speeds), np.zeros(model.nu)
    sizes = speed_sizes(model)[free]
    engine = model.looped
    missing = engine.inverse_dynamics(t, q, still, still, engine.start_memory())[free] * sizes
    stiffness = matrices(engine, State(t, q, still, still), free).K * np.outer(sizes, sizes)
    scale = float(np.abs(stiffness).max(initial=0))
    return float(np.abs(missing).max(initial=0)) <= _AT_REST * scale


def _turning(model: Compiled, state: State) -> Array | None:
    """See `Linear.turning`; exact."""
    if not state.u.any() or all(h.straight for h in model.layout.hinges.values() if h.nu):
        return None
    of = np.array([[state.t]]), state.q[None], state.u[None], np.zeros((1, model.nu))
    found = Differentiation(model, ()).at(*of)["rate_q"][0]
    return np.asarray(found[np.ix_(model.free_speeds, model.free_speeds)])
