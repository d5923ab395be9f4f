"""Displacements of bodies by the increments of a linear model, and the whirl of its motions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ...engine.characteristic_scales import scene_length
from ...engine.engine_calls import Probe
from ...engine.observation_columns import POINT_COLUMNS, SUMS
from ..mck_matrices import State
from .blades import find_blades

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..linear_equations import LinearEquations

#: Squares of sums of displacements that are rounding, in parts of those of the displacements.
_SEEN = 1e-18
#: Momentum times speed that is none, in parts of the kinetic energy.
_NO_DRIFT = 1e-7


def displacements(linear: LinearEquations, state: State) -> Array:
    """(rows, n): twists of all bodies and of sections of beams for a unit of each increment, of the
    point at the origin of inertial axes, which goes along with the mean motion; rotations count as
    a length of the scene."""
    length = scene_length(linear.model)
    points = _points(linear, state, linear.spread(np.eye(len(linear))).T)
    place, velocity, spin = (points[..., POINT_COLUMNS[kind]] for kind in _KINDS)
    centre = state.t * _drift(linear)
    found = np.concatenate([velocity + np.cross(spin, centre - place), length * spin], axis=1)
    return np.asarray(found.reshape(len(linear), -1).T)


def whirl(linear: LinearEquations, shapes: NDArray[Any]) -> Array:
    """(k,) sense of the whirl of complex shapes (n, k) about the angular velocity of the body that
    spins fastest: 1 forward along a circle, -1 backward, between these along ellipses, 0 in a
    plane or along the axis.  Blades whirl by their sum, which is that of their mass centre."""
    axis = _spin(linear)
    rows = (displacements(linear, linear.state) @ shapes).reshape(2, -1, 3, shapes.shape[1])
    summed = _sum_of_blades(linear, rows).reshape(-1, 3, shapes.shape[1])
    turned = np.cross(np.conj(summed), summed, axis=1).imag
    flat = summed - axis[:, None] * np.einsum("i,nik->nk", axis, summed)[:, None]
    area = -np.einsum("i,nik->k", axis, turned)
    size = np.einsum("nik,nik->k", np.conj(flat), flat).real
    seen = size > _SEEN * np.einsum("anik,anik->k", np.conj(rows), rows).real
    return np.divide(area, size, out=np.zeros_like(area), where=seen)


def _sum_of_blades(linear: LinearEquations, rows: NDArray[Any]) -> NDArray[Any]:
    """(2, m, 3, k) of displacements (2, points, 3, k), of points of blades their sums."""
    if not linear.state.u.any():
        return rows
    blades, bodies = find_blades(linear), _bodies_of_points(linear)
    same = {int(body): int(one.bodies[0, k]) for one in blades
            for k, others in enumerate(one.bodies.T) for body in others}  # fmt: skip
    visits: dict[int, int] = {}
    places: dict[tuple[int, int], int] = {}
    found = np.zeros_like(rows)
    for k, body in enumerate(bodies):
        visits[body] = visits.get(body, -1) + 1
        key = same.get(body, body), visits[body]
        found[:, places.setdefault(key, len(places))] += rows[:, k]
    return found[:, : len(places)]


_KINDS = "position", "velocity", "angular_velocity"


def _points(linear: LinearEquations, state: State, speeds: Array) -> Array:
    """(m, points, 24), as of `Observation.points`, at speeds (m, nu): frames and ends of bodies,
    of beams sections instead."""
    packed, engine = linear.model.looped.packed, linear.model.looped.inertia_alone
    bodies, flexible = linear.model.scene.skeleton.bodies, linear.model.flexible
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
    slots = [linear.model.layout.modal[name].u_slice for name in beams]
    along = [_sections(body, frame, speeds[:, place])
             for body, frame, place in zip(beams.values(), frames, slots, strict=True)]  # fmt: skip
    return np.concatenate([points, *along], axis=1)


def _bodies_of_points(linear: LinearEquations) -> list[int]:
    """Positions in the tree of the bodies of all `_points`."""
    end, bodies = linear.model.looped.packed.end, linear.model.scene.skeleton.bodies
    found = [end(bodies.name(k))[0] for k in range(len(bodies))]
    for name in linear.model.flexible:
        found += [end(name)[0]] * len(bodies.ends(name) or ())
    for name, body in _beams(linear).items():
        found += [end(name)[0]] * len(_stations(body))
    return found


def _beams(linear: LinearEquations) -> dict[str, ModalBody]:
    flexible = linear.model.flexible
    return {name: body for name, body in flexible.items() if body.shapes is not None}


def _stations(body: ModalBody) -> Array:
    """Where sections of a beam are seen, m."""
    assert body.shapes is not None
    length, count = body.shapes.length, body.shapes.n + 3
    return np.asarray(length * (1 - np.cos(np.linspace(0, np.pi, count))) / 2)


def _sections(body: ModalBody, frame: Array, rates: Array) -> Array:
    """(m, sections, 24) of a beam at rates (m, modes), on its undeformed axis."""
    shapes = body.shapes
    assert shapes is not None
    x = _stations(body)
    values, rotation = shapes.at(x), frame[:, 15:24].reshape(-1, 1, 3, 3)
    found = np.repeat(frame[:, None], len(x), axis=1)
    arm = rotation[..., 0] * x[:, None]
    velocity, spin = POINT_COLUMNS["velocity"], POINT_COLUMNS["angular_velocity"]
    for columns, field in ((velocity, values.phi), (spin, values.theta)):
        own = np.einsum("xik,mk->mxi", field, rates)
        found[..., columns] += np.einsum("mxij,mxj->mxi", np.broadcast_to(
            rotation, (len(frame), len(x), 3, 3)), own)  # fmt: skip
    found[..., velocity] += np.cross(frame[:, None, spin], arm)
    found[..., POINT_COLUMNS["position"]] += arm
    return found


def _drift(linear: LinearEquations) -> Array:
    """(3,) velocity of the body that turns least, where the scene has linear momentum."""
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
    """(3,) angular velocity of a body or end at the state, rad/s, inertial axes."""
    engine, state = linear.model.looped, linear.state
    of = np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None]
    probe = Probe(*linear.model.looped.packed.end(name))
    points = engine.observe(*of, [probe], parts=("points",)).points
    return np.asarray(points[0, 0, POINT_COLUMNS["angular_velocity"]])


def _spin(linear: LinearEquations) -> Array:
    """(3,) unit vector of the largest angular velocity of a body, of the x axis without spin."""
    turns = _points(linear, linear.state, linear.state.u[None])[
        0, :, POINT_COLUMNS["angular_velocity"]
    ]
    fastest = turns[np.linalg.norm(turns, axis=1).argmax()]
    size = float(np.linalg.norm(fastest))
    return np.asarray(fastest / size) if size else np.array([1.0, 0.0, 0.0])
