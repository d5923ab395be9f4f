"""Initial state of a compiled scene: drives, closed loops and static deformations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from ..engine.compiled_scene import CompiledScene, speed_scales
from ..engine.loops.independent_speeds import IndependentSpeeds
from ..engine.static_equilibrium import (
    EquilibriumNotFoundError,
    EquilibriumProblem,
    UndeterminedEquilibriumError,
    find_determined_equilibrium,
)
from ..flexible.modal_body import ModalBody, modal_sizes
from ..packing.coordinate_layout import HingeSlots, start_values
from .scene_system import SceneSystem


def initial_state(compiled: CompiledScene) -> tuple[Array, Array]:
    """Initial state (q, u) at t = 0; NumericalFailure where a static deformation is not found."""
    packed, engine = compiled.packed_scene, compiled.looped
    q, u = start_values(packed.scene, compiled.coordinate_layout, packed.flexible)
    if compiled.loop_start is None:
        y = SceneSystem(engine).start(0.0, q, u)
        q, u = y[: compiled.nq], y[compiled.nq : compiled.nq + compiled.nu]
    else:
        q, u = (x.copy() for x in compiled.loop_start.start)
    tables = (*packed.user_scene.beam, *packed.user_scene.elastic)
    static_names = [b.name for b in tables if b.name in packed.flexible and b.initial.static]
    if not static_names:
        return q, u
    bodies = {name: compiled.flexible_bodies[name] for name in static_names}
    if compiled.independent_speeds is not None:
        return static_deformation_with_loops(compiled, compiled.independent_speeds, q, u, bodies)
    memory = engine.start_memory()
    q = static_deformation(
        lambda q, u, udot: engine.inverse_dynamics(0.0, q, u, udot, memory),
        q, u, bodies, compiled.coordinate_layout.modal,
    )  # fmt: skip
    return q, u


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


#: Longest step of a motion relative to the characteristic scales: after a longer one the loops may
#: close in another configuration.
_MAX_STEP = 0.1
#: Drift (m, rad) of fixed coordinates that counts as rounding, and largest number of corrections.
_MAX_DRIFT, _MAX_CORRECTIONS = 1e-13, 20


class ClosedStates:
    """Closed states of a model at time t (s); `freedom` gives its independent speeds."""

    def __init__(self, model: CompiledScene, freedom: IndependentSpeeds, t: float) -> None:
        self.engine, self.freedom, self.t = model.looped, freedom, t
        self.layout, self.sizes = model.coordinate_layout, speed_scales(model)
        self.memory = model.looped.start_memory()
        self._scene = SceneSystem(model.looped, with_power=False)
        self._zero_speeds = np.zeros(model.nu)

    def state(self, q: Array, u: Array | None = None) -> tuple[Array, Array]:
        """Nearby state (q, u) that satisfies all constraints; u = 0 before projection by default.

        Raises NumericalFailure where the loops do not close.
        """
        try:
            y = self._scene.start(self.t, q, self._zero_speeds if u is None else u)
        except SceneError as error:
            raise NumericalFailure(str(error)) from None
        return y[: self.engine.nq], y[self.engine.nq :]

    def accelerations(self, q: Array, u: Array, places: Sequence[int], follows: Array) -> Array:
        """Accelerations (nu,) due to loops and drives with zero ones of the speeds `places`.

        `follows` (nu, k) gives all speeds from these k independent ones.
        """
        state = np.array([self.t]), q[None], u[None], self.memory[None]
        udot = self.engine.accelerations(*state)[1][0]
        return np.asarray(udot - follows @ udot[list(places)])

    def move(self, q: Array, places: Sequence[int], motion: Array) -> Array:
        """q after a motion of the independent speeds `places`, with all loops closed."""
        length = float(np.abs(motion / self.sizes[list(places)]).max(initial=0.0))
        step_count = max(1, int(np.ceil(length / _MAX_STEP)))
        for _ in range(step_count):
            q = self._step(q, places, motion / step_count)
        return q

    def move_with_fixed(self, q: Array, places: Sequence[int], motion: Array, held: int) -> Array:
        """q after a motion that leaves the coordinates of the first `held` speeds unchanged."""
        start = q
        q = self.move(q, places, motion)
        for _ in range(_MAX_CORRECTIONS):
            drift = np.zeros(len(places))
            drift[:held] = self._motion_to(start, q, places[:held])
            if not np.abs(drift).max(initial=0.0) > _MAX_DRIFT:
                break
            q = self._step(q, places, drift)
        return q

    def _step(self, q: Array, places: Sequence[int], motion: Array) -> Array:
        follows = self.freedom.motion_matrix(q, places)
        return self.state(self.freedom.move(q, follows @ motion))[0]

    def _motion_to(self, target: Array, q: Array, places: Sequence[int]) -> Array:
        """Motion along the speeds `places` that moves their coordinates from q to `target`."""
        motion = np.zeros(len(self.sizes))
        slots_by_speed = {slots.u: slots for slots in map(self.layout.hinge_of_speed, places)}
        for slots in slots_by_speed.values():
            gap = (target - q)[slots.q_slice]
            if not slots.rates_are_speeds:
                speeds = np.eye(len(motion))[slots.u_slice]
                rates = [self.engine.rates(self.t, q, speed, self.memory) for speed in speeds]
                rate_matrix = np.array(rates)[:, slots.q_slice].T
                gap = np.asarray(np.linalg.lstsq(rate_matrix, gap, rcond=None)[0])
            motion[slots.u_slice] = gap
        return motion[list(places)]
