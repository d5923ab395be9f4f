"""Static deformation of flexible bodies under the loads at t = 0."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ...engine.static_equilibrium import (
    EquilibriumNotFoundError,
    EquilibriumProblem,
    UndeterminedEquilibriumError,
    find_determined_equilibrium,
)
from ...flexible.modal_body import ModalBody
from ...flexible.modal_scales import modal_sizes
from ...packing.coordinate_layout import HingeSlots
from .closed_states import ClosedStates

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...engine.loops.independent_speeds import IndependentSpeeds

#: (q, u, udot) -> efforts (nu,) that these accelerations need.
InverseDynamics = Callable[[Array, Array, Array], Array]

_ACCURACY = 1e-10

#: Rotation of a section, rad, from which on the kernels reject a state.
_MAX_ROTATION = 1.5


def static_deformation(
    inverse_dynamics: InverseDynamics,
    q: Array,
    u: Array,
    bodies: Mapping[str, ModalBody],
    slots: Mapping[str, HingeSlots],
) -> Array:
    """q with the modal coordinates of `bodies` in static equilibrium.

    Modal speeds and accelerations are zero.  Hinges keep their coordinates and their speeds without
    acceleration, so that a spinning blade starts stretched.  Raises NumericalFailure if there is no
    equilibrium nearby.
    """
    q_indices = _indices(slots[name].q_slice for name in bodies)
    u_indices = _indices(slots[name].u_slice for name in bodies)
    u, zero = u.copy(), np.zeros(len(u))
    u[u_indices] = 0.0

    def advance(q: Array, increment: Array) -> Array:
        result = q.copy()
        result[q_indices] += increment
        return result

    scales = np.concatenate([modal_sizes(body) for body in bodies.values()])
    problem = EquilibriumProblem(lambda q: inverse_dynamics(q, u, zero)[u_indices], advance, scales)
    return _find_deformation(problem, q, bodies, slots)


def static_deformation_with_loops(
    model: CompiledScene,
    freedom: IndependentSpeeds,
    q: Array,
    u: Array,
    bodies: Mapping[str, ModalBody],
) -> tuple[Array, Array]:
    """(q, u) near a closed state with the modal coordinates of `bodies` in static equilibrium.

    Like `static_deformation`, with closed loops: independent hinge speeds, as many as the mechanism
    has with rigid bodies, keep their coordinates and speeds, as do the modes of other bodies; the
    other hinges follow.
    """
    slots, closed = model.coordinate_layout.modal, ClosedStates(model, freedom, 0.0)
    modal_speeds = _indices(slots[name].u_slice for name in bodies).tolist()
    fixed, own = freedom.select_fixed_speeds(q, modal_speeds, *_fixed_speeds(model, u, bodies))
    independent, count = (*fixed, *own), len(fixed)
    independent_u = np.append(u[list(fixed)], np.zeros(len(own)))

    def motion(q: Array) -> tuple[Array, Array, Array]:
        """All speeds and accelerations for unaccelerated independent speeds, and the Jacobian."""
        jacobian, projected_u = freedom.motion_matrix(q, independent), closed.state(q, u)[1]
        speeds = projected_u + jacobian @ (independent_u - projected_u[list(independent)])
        speeds[list(independent)] = independent_u
        return speeds, closed.accelerations(q, speeds, independent, jacobian), jacobian

    def modal_efforts(q: Array) -> Array:
        speeds, udot, jacobian = motion(q)
        efforts = closed.engine.inverse_dynamics(0.0, q, speeds, udot, closed.memory)
        return np.asarray(jacobian[:, count:].T @ efforts)

    def advance(q: Array, increment: Array) -> Array:
        return closed.move_with_fixed(q, independent, np.append(np.zeros(count), increment), count)

    problem = EquilibriumProblem(modal_efforts, advance, closed.sizes[list(own)], own)
    q = _find_deformation(problem, q, bodies, slots)
    return q, motion(q)[0]


def _fixed_speeds(
    model: CompiledScene, u: Array, bodies: Mapping[str, ModalBody]
) -> tuple[list[int], ...]:
    """Speeds to keep while `bodies` deform, and speeds to keep in preference to others.

    The former belong to hinges with `hold` and to the modes of other bodies, the latter to hinges
    with a given speed.
    """
    layout, free = model.coordinate_layout, set(model.free_speed_indices)
    slices = [slots.u_slice for name, slots in layout.modal.items() if name not in bodies]
    slices += [layout.hinges[h.name].u_slice for h in model.packed_scene.user_scene.hinge if h.hold]
    fast = [] if model.loop_start is None else model.loop_start.fast_hinges
    preferred = _indices(layout.hinges[name].u_slice for name in fast).tolist()
    fixed = [k for k in _indices(slices).tolist() if k in free]
    return fixed, [k for k in preferred if k in free - {*fixed} and u[k]]


def _indices(slices: Iterable[slice]) -> NDArray[np.int64]:
    return np.concatenate([np.zeros(0, np.int64), *(np.arange(s.start, s.stop) for s in slices)])


def _find_deformation(
    problem: EquilibriumProblem,
    q: Array,
    bodies: Mapping[str, ModalBody],
    slots: Mapping[str, HingeSlots],
) -> Array:
    try:
        q = find_determined_equilibrium(problem, q, _ACCURACY)
    except (EquilibriumNotFoundError, UndeterminedEquilibriumError) as failure:
        names = ", ".join(f'"{name}"' for name in bodies)
        is_critical = isinstance(failure, UndeterminedEquilibriumError)
        load = "are at the buckling load" if is_critical else "may exceed the buckling load"
        raise NumericalFailure(
            f"{names}: no static deformation found under the loads at t = 0, which {load}; "
            "start undeformed or give eta"
        ) from None
    for name, body in bodies.items():
        _check_rotation(body, q[slots[name].q_slice])
    return q


def _check_rotation(body: ModalBody, eta: Array) -> None:
    """Raise NumericalFailure for a deformation that rotates an end beyond the model's range."""
    rotation = max(float(np.linalg.norm(port.theta @ eta)) for port in body.ports.values())
    if rotation > _MAX_ROTATION:
        raise NumericalFailure(
            f'"{body.name}": the static deformation under the loads at t = 0 rotates an end by '
            f"{rotation:.2g} rad relative to its frame, expected at most {_MAX_ROTATION:g}; check "
            "the stiffness, split the body into several welded ones, or start undeformed"
        )
