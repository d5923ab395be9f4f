"""What a linear model cannot say of its scene: states that do not last, and what nothing holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

from ..engine.sizes import speed_sizes
from ..run.system import SceneSystem
from .matrices import State
from .output.outputs import left_out

if TYPE_CHECKING:
    from .equations import Equations
    from .motions import Modes

#: Distance from rest, and acceleration per s^2 of what nothing holds, in sizes of coordinates;
#: stiffness that counts as none, in parts; matrices that still count as the same, in parts.
_STILL, _SOFT, SAME = 1e-6, 1e-13, 1e-6
#: Efforts that are rounding, in parts of those that cancel.
_CANCELLED = 1e-11
#: How far matrices are compared along the motion, in rad or sizes.
_AHEAD = 0.1
#: Coordinates that a sentence names.
_NAMED = 4


def warnings_of(linear: Equations, found: Modes) -> Iterator[str]:
    """Sentences, the gravest first."""
    leaving = accelerating(linear)
    if leaving:
        yield (
            f"the state does not last: {some(leaving)} accelerate there, so that the model "
            "holds beside the motion through it, and only for a moment"
        )
    elif linear.state.u.any() and _changes(linear):
        yield (
            "the matrices change along the motion of this state: frequencies and growth of one "
            "moment are not those of the motion"
        )
    for name, column in zip(linear.inputs, linear.V.T, strict=True):
        if len(linear) and not column.any():
            yield f"input {name} moves nothing at this state"
    for one in linear.model.scene.controller:
        yield (
            f'controller "{one.name}" is left out: its inputs ({some(list(one.outputs))}) stand '
            "still at the values of the scene"
        )
    for name, why in left_out(linear):
        yield f"output {name} is not among the outputs: {why}"
    if linear.model.packed.system.timed:
        yield f"what acts goes by time: the model is that of t = {linear.state.t:g} s"
    growing = found.eigenvalues.real.max(initial=0)
    if growing > 0:
        k = int(found.eigenvalues.real.argmax())
        moving = some(found.moving(k))
        yield f"unstable: a motion of {moving} grows with {growing:.4g} 1/s"
    free = np.flatnonzero(found.omega == 0)
    if len(free):
        moved = dict.fromkeys(name for k in free for name in found.moving(int(k)))
        yield f"nothing pushes back {some(list(moved))}: motions of frequency 0"


def unrest(linear: Equations) -> bool:
    """Whether closed loops are at a state that does not last, so that accelerations turn rows."""
    if linear.mechanism is None or not accelerating(linear):
        return False
    return not _balanced(linear, linear.mechanism.ways)


def _balanced(linear: Equations, ways: Array) -> bool:
    """Whether what pushes along the motions of a mechanism is rounding of what cancels there, which
    may still move what hardly anything holds."""
    state, tree = linear.state, linear.tree
    efforts = tree.inverse_dynamics(state.t, state.q, state.u, 0 * state.a, tree.start_memory())
    left, whole = np.abs(ways.T @ efforts), np.abs(ways).T @ np.abs(efforts)
    return bool((left <= _CANCELLED * whole).all())


def accelerating(linear: Equations) -> list[str]:
    """Coordinates that leave the state: those further from rest than a small part of their sizes,
    and those that accelerate though nothing holds them."""
    free = list(linear.free)
    a, sizes = linear.state.a[free], speed_sizes(linear.model)[free]
    if not a.any():
        return []
    stiffness = linear.K * np.outer(sizes, sizes)
    pushed = (linear.M @ a) * sizes
    away = np.linalg.lstsq(stiffness, pushed, rcond=_SOFT)[0]
    left = np.linalg.solve(linear.M, (pushed - stiffness @ away) / sizes) / sizes
    leaves = (np.abs(away) > _STILL) | (np.abs(left) > _STILL)
    return [linear.coordinates[k] for k in np.flatnonzero(leaves)]


def _changes(linear: Equations) -> bool:
    """Whether the matrices are others a little further along the motion."""
    there = later(linear)
    return any(apart(getattr(linear, x), getattr(there, x)) > SAME for x in "MCK")


def later(linear: Equations) -> Equations:
    """The equations a little further along the motion."""
    state, loops = ahead(linear), linear.mechanism
    loops = None if loops is None else loops.at(state)
    turning = linear.turning if loops is None else loops.turning
    return replace(linear, state=state, about=None, mechanism=loops, turning=turning)


def ahead(linear: Equations) -> State:
    """The state a little further along the motion, with the same speeds."""
    model, state = linear.model, linear.state
    engine, memory = model.looped, model.looped.start_memory()
    dt = _AHEAD / float(np.abs(state.u).max())
    q = state.q + dt * engine.rates(state.t, state.q, state.u, memory)
    whole = SceneSystem(engine).start(state.t + dt, q, state.u)
    q, u = whole[: model.nq], whole[model.nq : model.nq + model.nu]
    _, a = engine.accelerations(state.t + dt, q[None].copy(), u[None].copy(), memory[None])
    return State(state.t + dt, q, u, a[0])


def apart(one: Array, other: Array) -> float:
    """Largest difference, in parts of the largest entry."""
    scale = float(np.abs(one).max(initial=0))
    return float(np.abs(one - other).max(initial=0)) / scale if scale else 0.0


def some(names: list[str]) -> str:
    """The first few names, and how many more there are."""
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")
