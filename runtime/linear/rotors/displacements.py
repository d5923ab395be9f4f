"""Body displacements due to perturbations of a linear model, and whirl of its modes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ...engine.compiled_scene import scene_length
from ...engine.looped_engine import Probe
from ...engine.quantity_registry import POINT_COLUMNS, SUMS
from ..mck_matrices import State
from .blades import find_blades

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..linear_equations import LinearEquations

#: Squared sums of displacements that are rounding, relative to the squared displacements.
_SEEN = 1e-18
#: Momentum times speed that counts as zero, relative to the kinetic energy.
_NO_DRIFT = 1e-7


def displacements(linear: LinearEquations, state: State) -> Array:
    """Twists (rows, n) of all bodies and beam sections for a unit of each perturbation.

    In inertial axes, at a reference point that is the origin at t = 0 and moves with the drift
    velocity.  Rotations are multiplied by the characteristic length of the scene.
    """
    length = scene_length(linear.model)
    points = _points(linear, state, linear.expand(np.eye(len(linear))).T)
    position, velocity, spin = (points[..., POINT_COLUMNS[kind]] for kind in _KINDS)
    centre = state.t * _drift(linear)
    rows = np.concatenate([velocity + np.cross(spin, centre - position), length * spin], axis=1)
    return np.asarray(rows.reshape(len(linear), -1).T)


def whirl(linear: LinearEquations, shapes: NDArray[Any]) -> Array:
    """Whirl sense (k,) of complex mode shapes (n, k) about the spin axis of the fastest body.

    1 is forward circular whirl, -1 backward circular whirl, values in between are elliptic orbits,
    and 0 is motion in a plane or along the axis.  Blades enter by the sum of their displacements,
    which is that of their common mass centre.
    """
    axis = _spin_axis(linear)
    rows = (displacements(linear, linear.state) @ shapes).reshape(2, -1, 3, shapes.shape[1])
    summed = _sum_of_blades(linear, rows).reshape(-1, 3, shapes.shape[1])
    turned = np.cross(np.conj(summed), summed, axis=1).imag
    flat = summed - axis[:, None] * np.einsum("i,nik->nk", axis, summed)[:, None]
    area = -np.einsum("i,nik->k", axis, turned)
    size = np.einsum("nik,nik->k", np.conj(flat), flat).real
    seen = size > _SEEN * np.einsum("anik,anik->k", np.conj(rows), rows).real
    return np.divide(area, size, out=np.zeros_like(area), where=seen)


def _sum_of_blades(linear: LinearEquations, rows: NDArray[Any]) -> NDArray[Any]:
    """Displacements (2, m, 3, k) from (2, points, 3, k), summed over the blades of a hub."""
    if not linear.state.u.any():
        return rows
    blades, bodies = find_blades(linear), _bodies_of_points(linear)
    same = {int(body): int(group.bodies[0, k]) for group in blades
            for k, bodies in enumerate(group.bodies.T) for body in bodies}  # fmt: skip
    visits: dict[int, int] = {}
    row_by_branch: dict[tuple[int, int], int] = {}
    summed_rows = np.zeros_like(rows)
    for k, body in enumerate(bodies):
        visits[body] = visits.get(body, -1) + 1
        key = same.get(body, body), visits[body]
        summed_rows[:, row_by_branch.setdefault(key, len(row_by_branch))] += rows[:, k]
    return summed_rows[:, : len(row_by_branch)]


_KINDS = "position", "velocity", "angular_velocity"


def _points(linear: LinearEquations, state: State, speeds: Array) -> Array:
    """Point motion (m, points, 24) at speeds (m, nu); columns of `Observation.points`.

    The points are the frames of all bodies, the ends of flexible bodies and the sections of beams.
    """
    packed, engine = linear.model.looped.packed, linear.model.looped.inertia_only
    bodies, flexible = linear.model.scene.skeleton.bodies, linear.model.flexible_bodies
    names = [bodies.name(k) for k in range(len(bodies))]
    probes = [Probe(*packed.end(name)) for name in names]
    for name in flexible:
        probes += [Probe(*packed.end(f"{name}.{end}")) for end in bodies.ends(name) or ()]
    n = len(speeds)
    of = np.full(n, state.t), np.tile(state.q, (n, 1)), np.ascontiguousarray(speeds)
    memory = np.tile(engine.start_memory(), (n, 1))
    points = engine.observe(*of, memory, probes, parts=("points",)).points
    beams = _beams(linear)
    frames = [points[:, names.index(name)] for name in beams]
    slots = [linear.model.coordinate_layout.modal[name].u_slice for name in beams]
    along = [_sections(body, frame, speeds[:, slot])
             for body, frame, slot in zip(beams.values(), frames, slots, strict=True)]  # fmt: skip
    return np.concatenate([points, *along], axis=1)


def _bodies_of_points(linear: LinearEquations) -> list[int]:
    """Tree indices of the bodies of all `_points`."""
    end, bodies = linear.model.looped.packed.end, linear.model.scene.skeleton.bodies
    owners = [end(bodies.name(k))[0] for k in range(len(bodies))]
    for name in linear.model.flexible_bodies:
        owners += [end(name)[0]] * len(bodies.ends(name) or ())
    for name, body in _beams(linear).items():
        owners += [end(name)[0]] * len(_stations(body))
    return owners


def _beams(linear: LinearEquations) -> dict[str, ModalBody]:
    flexible = linear.model.flexible_bodies
    return {name: body for name, body in flexible.items() if body.shapes is not None}


def _stations(body: ModalBody) -> Array:
    """Positions x of the observed sections of a beam, m."""
    assert body.shapes is not None
    length, count = body.shapes.length, body.shapes.n + 3
    return np.asarray(length * (1 - np.cos(np.linspace(0, np.pi, count))) / 2)


def _sections(body: ModalBody, frame: Array, rates: Array) -> Array:
    """Section motion (m, sections, 24) of an undeformed beam at modal rates (m, modes).

    `frame` (m, 24) is the motion of the body frame.
    """
    shapes = body.shapes
    assert shapes is not None
    x = _stations(body)
    values, rotation = shapes.values_at(x), frame[:, 15:24].reshape(-1, 1, 3, 3)
    sections = np.repeat(frame[:, None], len(x), axis=1)
    arm = rotation[..., 0] * x[:, None]
    velocity, spin = POINT_COLUMNS["velocity"], POINT_COLUMNS["angular_velocity"]
    for columns, field in ((velocity, values.phi), (spin, values.theta)):
        own = np.einsum("xik,mk->mxi", field, rates)
        sections[..., columns] += np.einsum("mxij,mxj->mxi", np.broadcast_to(
            rotation, (len(frame), len(x), 3, 3)), own)  # fmt: skip
    sections[..., velocity] += np.cross(frame[:, None, spin], arm)
    sections[..., POINT_COLUMNS["position"]] += arm
    return sections


def _drift(linear: LinearEquations) -> Array:
    """Drift velocity (3,), m/s: that of the body with least rotation; 0 without linear momentum."""
    state, engine = linear.state, linear.model.looped
    of = np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None]
    sums = engine.observe(*of, (), parts=("sums",)).sums[0]
    points = _points(linear, state, state.u[None])[0]
    size = np.linalg.norm(points[:, POINT_COLUMNS["velocity"]], axis=1).max()
    momentum = np.linalg.norm(sums[SUMS["momentum"][2]]) * size
    if momentum <= _NO_DRIFT * sums[SUMS["energy.kinetic"][2]]:
        return np.zeros(3)
    least = np.linalg.norm(points[:, POINT_COLUMNS["angular_velocity"]], axis=1).argmin()
    return np.asarray(points[least, POINT_COLUMNS["velocity"]])


def angular_velocity(linear: LinearEquations, name: str) -> Array:
    """Angular velocity (3,) of a body or end at the operating point, rad/s, inertial axes."""
    engine, state = linear.model.looped, linear.state
    of = np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None]
    probe = Probe(*linear.model.looped.packed.end(name))
    points = engine.observe(*of, [probe], parts=("points",)).points
    return np.asarray(points[0, 0, POINT_COLUMNS["angular_velocity"]])


def _spin_axis(linear: LinearEquations) -> Array:
    """Unit vector (3,) of the largest angular velocity of a body; the x axis without spin."""
    turns = _points(linear, linear.state, linear.state.u[None])[
        0, :, POINT_COLUMNS["angular_velocity"]
    ]
    fastest = turns[np.linalg.norm(turns, axis=1).argmax()]
    size = float(np.linalg.norm(fastest))
    return np.asarray(fastest / size) if size else np.array([1.0, 0.0, 0.0])
