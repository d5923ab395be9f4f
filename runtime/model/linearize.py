"""Where a model is made linear: at its equilibrium, or at a state that is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..engine.sizes import speed_sizes
from ..linear.channels import GROUND, channel
from ..linear.linear import Linear
from ..linear.matrices import State, matrices
from ..run.start import initial_state
from ..run.system import SceneSystem
from .derivatives import Differentiation
from .equilibrium import equilibrium, free_speeds

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
    pushes = tuple(channel(model, name) for name in inputs)
    named = GROUND if disturbances is None else disturbances
    others = tuple(channel(model, name) for name in named)
    state, free = _state(model, q, u, t), free_speeds(model)
    about = [_increment(model, j) for j in free]
    return Linear(
        model, state, tuple(free), tuple(name for name, _ in about), tuple(x for _, x in about),
        pushes, others, _turning(model, state, free),
    )  # fmt: skip


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
    free, still = free_speeds(model), np.zeros(model.nu)
    sizes = speed_sizes(model)[free]
    engine = model.looped
    missing = engine.inverse_dynamics(t, q, still, still, engine.start_memory())[free] * sizes
    stiffness = matrices(engine, State(t, q, still, still), free).K * np.outer(sizes, sizes)
    scale = float(np.abs(stiffness).max(initial=0))
    return float(np.abs(missing).max(initial=0)) <= _AT_REST * scale


def _increment(model: Compiled, speed: int) -> tuple[str, str]:
    """Name and unit of a tangent increment: of the coordinate, where its rate is the speed."""
    slots = model.layout.hinge_of_speed(speed)
    k = speed - slots.u
    if slots.straight:
        return f"{slots.name}.{slots.q_names[k]}", slots.q_units[k]
    return f"{slots.name}.{slots.u_names[k]}_increment", slots.u_units[k].removesuffix("/s")


def _turning(model: Compiled, state: State, free: list[int]) -> Array | None:
    """See `Linear.turning`; exact."""
    curved = any(not slots.straight for slots in model.layout.hinges.values() if slots.nu)
    if not curved or not state.u.any():
        return None
    of = np.array([[state.t]]), state.q[None], state.u[None], np.zeros((1, model.nu))
    found = Differentiation(model, ()).at(*of)["rate_q"][0]
    return np.asarray(found[np.ix_(free, free)])
