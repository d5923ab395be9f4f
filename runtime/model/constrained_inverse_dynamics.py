"""Inverse dynamics and mass matrix of mechanisms: what their tree asks for, along the motions that
loops leave.

With N of `IndependentSpeeds`, u = N v, loads of rows do no work along N: N^T R = N^T tau, where R
are the efforts that the tree would need for the accelerations if its loops were open.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, batch
from mstmm.errors import NumericalFailure, SceneError

from ..engine.compiled_scene import CompiledScene
from ..engine.loops.independent_speeds import IndependentSpeeds
from ..linear.input_channels import channel, names_of
from ..packing.coordinate_layout import refuse_dense

#: Accelerations that tear a loop, in parts of those that there are.
_TORN = 1e-6
#: Actuators are none that a motion moves by less than this, in parts of what it moves most.
_WEAK = 1e-7


def reduced_mass(model: CompiledScene, q: Array) -> Array:
    """N^T M N (n, n) of the independent speeds at q (nq,)."""
    assert model.freedom is not None
    refuse_dense(len(model.freedom.places), "the mass matrix")
    ways = model.freedom.following(q, model.freedom.places)
    matrix = model.looped.required_by_inertia(q, ways.T) @ ways
    return np.asarray((matrix + matrix.T) / 2)


def constrained_inverse_dynamics(
    model: CompiledScene,
    q: ArrayLike,
    u: ArrayLike,
    udot: ArrayLike,
    t: ArrayLike,
    actuators: Sequence[str] | None,
) -> Array:
    """Efforts (..., nu); see `Model.inverse_dynamics`."""
    assert model.freedom is not None
    nu, places = model.nu, model.freedom.places
    acting = list(places) if actuators is None else _acting(model, actuators)
    few = np.ndim(udot) > 0 and np.shape(udot)[-1] == len(places) != nu
    if np.ndim(udot) > 0 and np.shape(udot)[-1] not in (nu, len(places)):
        raise SceneError(
            f"udot has shape {np.shape(udot)}, expected (..., {len(places)}) of the independent "
            f"speeds or (..., {nu}) of all"
        )
    lead, (times, coordinates, speeds, rates) = batch(
        ("t", t, None), ("q", q, model.nq), ("u", u, nu),
        ("udot", udot, len(places) if few else nu),
    )  # fmt: skip
    rows = [
        _efforts(model, float(at), a, b, c, acting)
        for at, a, b, c in zip(times, coordinates, speeds, rates, strict=True)
    ]
    return np.array(rows).reshape(*lead, nu)


def _acting(model: CompiledScene, names: Sequence[str]) -> list[int]:
    """Places of the speeds of actuators; SceneError unless they are as many as the motions."""
    found = list[int]()
    for name in names_of("actuators", names):
        slots = model.layout.hinges.get(name)
        if slots is not None:
            own = range(slots.u, slots.u + slots.nu)
            found += [speed for speed in own if speed in model.free_speeds]
        else:
            found.append(_of_effort(model, name))
    count, wanted = len(set(found)), len(model.freedom.places) if model.freedom else 0
    if count != wanted:
        raise SceneError(
            f"actuators: {count} speeds act, the mechanism has {wanted} left free; name as "
            f"many, such as hinges of {', '.join(model.layout.u_name(k) for k in _places(model))}"
        )
    return sorted(set(found))


def _places(model: CompiledScene) -> tuple[int, ...]:
    return model.freedom.places if model.freedom else ()


def _of_effort(model: CompiledScene, name: str) -> int:
    one = channel(model, name)
    if one.speed < 0:
        raise SceneError(
            f'actuators: "{name}": expected a hinge, or an effort of one such as "shoulder.effort"'
        )
    return one.speed


def _efforts(
    model: CompiledScene, t: float, q: Array, u: Array, rates: Array, acting: list[int]
) -> Array:
    """Efforts (nu,) at one state."""
    engine, freedom = model.looped, model.freedom
    assert freedom is not None
    places, memory = list(freedom.places), engine.start_memory()
    ways = freedom.following(q, places)
    forced = engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None])[1][0]
    wanted = rates if len(rates) == len(places) else rates[places]
    a = forced + ways @ (wanted - forced[places])
    if len(rates) != len(places):
        _refuse_torn(model, rates, a)
    needed = engine.inverse_dynamics(t, q, u, a, memory)
    if not _all_ways(freedom, ways, acting):
        names = ", ".join(model.layout.u_name(k) for k in acting)
        raise NumericalFailure(
            f"actuators: at this state efforts along {names} do not move the mechanism all ways; "
            "name others, or take another state"
        )
    efforts = np.zeros(engine.nu)
    efforts[acting] = np.linalg.solve(ways[acting].T, ways.T @ needed)
    for speed in sorted({*range(engine.nu)} - {*model.free_speeds}):
        efforts[speed] = freedom.driving(q, speed) @ (needed - efforts)
    return efforts


def _all_ways(freedom: IndependentSpeeds, ways: Array, acting: list[int]) -> bool:
    """Whether efforts along some speeds move a mechanism all ways, lengths beside turns."""
    sizes = freedom.sizes
    scaled = ways * sizes[list(freedom.places)] / sizes[:, None]
    least = np.linalg.svd(scaled[acting], compute_uv=False).min(initial=np.inf)
    return bool(least > _WEAK * np.abs(scaled).max(initial=0.0))


def _refuse_torn(model: CompiledScene, given: Array, closed: Array) -> None:
    """SceneError for accelerations that no motion of the mechanism has."""
    free = list(model.free_speeds)
    apart = np.abs(given - closed)[free]
    scale = max(1.0, float(np.abs(given[free]).max(initial=0.0)), float(np.abs(closed).max()))
    if apart.max(initial=0.0) > _TORN * scale:
        k = free[int(apart.argmax())]
        raise SceneError(
            f"udot of {model.layout.u_name(k)} is {given[k]:.6g}, where the loops go on closed "
            f"with {closed[k]:.6g}; give the accelerations of the independent speeds alone: "
            f"{', '.join(model.layout.u_name(j) for j in _places(model))}"
        )
