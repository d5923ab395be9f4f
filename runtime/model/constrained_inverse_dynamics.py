"""Inverse dynamics and mass matrix of mechanisms with closed loops.

With u = N v of `IndependentSpeeds`, constraint loads do no work along N: N^T R = N^T tau, where R
are the efforts that the open tree would need for the accelerations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, batch
from mstmm.errors import NumericalFailure, SceneError

from ..engine.compiled_scene import CompiledScene
from ..engine.loops.independent_speeds import IndependentSpeeds
from ..linear.input_channels import channel, require_names
from ..packing.coordinate_layout import check_dense_size

#: Largest deviation of given accelerations from closed loops, relative to the largest one.
_MAX_OPENING = 1e-6
#: Smallest motion of an actuator, relative to the largest, for which it can drive the motion.
_MIN_SHARE = 1e-7


def reduced_mass(model: CompiledScene, q: Array) -> Array:
    """Mass matrix N^T M N (n, n) of the independent speeds at q (nq,)."""
    assert model.independent_speeds is not None
    check_dense_size(len(model.independent_speeds.indices), "the mass matrix")
    motions = model.independent_speeds.motion_matrix(q, model.independent_speeds.indices)
    matrix = model.looped.mass_matrix_product(q, motions.T) @ motions
    return np.asarray((matrix + matrix.T) / 2)


def constrained_inverse_dynamics(
    model: CompiledScene,
    q: ArrayLike,
    u: ArrayLike,
    udot: ArrayLike,
    t: ArrayLike,
    actuators: Sequence[str] | None,
) -> Array:
    """Efforts (..., nu) of a mechanism; see `Model.inverse_dynamics`."""
    assert model.independent_speeds is not None
    nu, places = model.nu, model.independent_speeds.indices
    actuator_speeds = list(places) if actuators is None else _actuator_speeds(model, actuators)
    is_reduced = np.ndim(udot) > 0 and np.shape(udot)[-1] == len(places) != nu
    if np.ndim(udot) > 0 and np.shape(udot)[-1] not in (nu, len(places)):
        raise SceneError(
            f"udot has shape {np.shape(udot)}, expected (..., {len(places)}) of the independent "
            f"speeds or (..., {nu}) of all"
        )
    lead, (times, coordinates, speeds, rates) = batch(
        ("t", t, None), ("q", q, model.nq), ("u", u, nu),
        ("udot", udot, len(places) if is_reduced else nu),
    )  # fmt: skip
    rows = [
        _efforts(model, float(time), a, b, c, actuator_speeds)
        for time, a, b, c in zip(times, coordinates, speeds, rates, strict=True)
    ]
    return np.array(rows).reshape(*lead, nu)


def _actuator_speeds(model: CompiledScene, names: Sequence[str]) -> list[int]:
    """Indices of the actuated speeds; raises SceneError unless their number is the mobility."""
    speeds = list[int]()
    for name in require_names("actuators", names):
        slots = model.coordinate_layout.hinges.get(name)
        if slots is not None:
            hinge_speeds = range(slots.u, slots.u + slots.nu)
            speeds += [speed for speed in hinge_speeds if speed in model.free_speed_indices]
        else:
            effort = channel(model, name)
            if effort.speed < 0:
                raise SceneError(
                    f'actuators: "{name}": expected a hinge, or an effort of one such as '
                    '"shoulder.effort"'
                )
            speeds.append(effort.speed)
    freedom = model.independent_speeds
    count, mobility = len(set(speeds)), len(freedom.indices) if freedom else 0
    if count != mobility:
        raise SceneError(
            f"actuators: expected as many speeds as the mobility of the mechanism, {mobility}, "
            f"found {count}; name, for example, the hinges of {_independent_names(model)}"
        )
    return sorted(set(speeds))


def _independent_names(model: CompiledScene) -> str:
    places = model.independent_speeds.indices if model.independent_speeds else ()
    return ", ".join(map(model.coordinate_layout.u_name, places))


def _efforts(
    model: CompiledScene, t: float, q: Array, u: Array, rates: Array, actuator_speeds: list[int]
) -> Array:
    """Efforts (nu,) of a mechanism at one state."""
    engine, freedom = model.looped, model.independent_speeds
    assert freedom is not None
    places, memory = list(freedom.indices), engine.start_memory()
    motions = freedom.motion_matrix(q, places)
    free_rates = engine.accelerations(t, q[None].copy(), u[None].copy(), memory[None])[1][0]
    target = rates if len(rates) == len(places) else rates[places]
    a = free_rates + motions @ (target - free_rates[places])
    if len(rates) != len(places):
        _check_closed(model, rates, a)
    tree_efforts = engine.inverse_dynamics(t, q, u, a, memory)
    if not _can_drive_all(freedom, motions, actuator_speeds):
        names = ", ".join(model.coordinate_layout.u_name(k) for k in actuator_speeds)
        raise NumericalFailure(
            f"actuators: at this state efforts along {names} cannot drive all motions of the "
            "mechanism; name other actuators, or use another state"
        )
    efforts = np.zeros(engine.nu)
    efforts[actuator_speeds] = np.linalg.solve(motions[actuator_speeds].T, motions.T @ tree_efforts)
    for speed in sorted({*range(engine.nu)} - {*model.free_speed_indices}):
        efforts[speed] = freedom.prescribed_motion(q, speed) @ (tree_efforts - efforts)
    return efforts


def _can_drive_all(freedom: IndependentSpeeds, motions: Array, actuator_speeds: list[int]) -> bool:
    """Whether efforts along the actuated speeds can drive all motions of a mechanism."""
    scales = freedom.sizes
    scaled = motions * scales[list(freedom.indices)] / scales[:, None]
    smallest = np.linalg.svd(scaled[actuator_speeds], compute_uv=False).min(initial=np.inf)
    return bool(smallest > _MIN_SHARE * np.abs(scaled).max(initial=0.0))


def _check_closed(model: CompiledScene, given: Array, closed: Array) -> None:
    """Raise SceneError for accelerations that open the loops."""
    free = list(model.free_speed_indices)
    differences = np.abs(given - closed)[free]
    scale = max(1.0, float(np.abs(given[free]).max(initial=0.0)), float(np.abs(closed).max()))
    if differences.max(initial=0.0) > _MAX_OPENING * scale:
        k = free[int(differences.argmax())]
        raise SceneError(
            f"udot of {model.coordinate_layout.u_name(k)} is {given[k]:.6g}, where closed loops "
            f"need {closed[k]:.6g}; give the accelerations of the independent speeds alone: "
            f"{_independent_names(model)}"
        )
