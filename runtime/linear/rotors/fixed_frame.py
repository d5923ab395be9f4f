"""Linear models of spinning rotors in the fixed frame.

Increments x of coordinates outboard of a spinning hinge turn along with the rotor.  At a steady
spin the displacements that they make in inertial axes, twists d = P(t) x of all bodies, turn with
it: where P(t) = P(0) T(t) with T(t) = exp(W t), the increments y = T x are those of the fixed
frame, d = P(0) y.  In these

    M y'' + (C - 2 M W) y' + (K - C W + M W^2) y = pushes,

with the matrices of x at t = 0, and the coefficients stay constant where the rotors are
axisymmetric, whatever their supports are: T^-T M(t) T^-1 = M(0), and likewise C and K.  Both
conditions are tested a little further along the motion.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import logm

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.printable import abbreviate

from ...engine.calls import Probe
from ...engine.shown import COLUMNS, SUMS
from ...engine.sizes import scene_length
from ..matrices import State
from .carrying import Carrying
from .later import SAME, ahead, later

if TYPE_CHECKING:
    from ...flexible.modal_body import ModalBody
    from ..equations import Equations

#: Displacements that count as the same, in parts; entries of matrices that are rounding, in parts.
_ALIKE, _ROUNDING = 1e-7, 1e-11
#: Singular values of displacements below this, in parts, are those of a motion that is not seen.
_SEEN = 1e-9


def frame_of(linear: Equations) -> str:
    """Frame of increments: "rotating" where they turn along with spinning bodies, else "fixed"."""
    return "rotating" if _is_rotating(linear) else "fixed"


def _is_rotating(linear: Equations) -> bool:
    if linear.carrying is not None or not len(linear) or not linear.state.u.any():
        return False
    now, then = (displacements(linear, state) for state in (linear.state, ahead(linear)))
    return bool(np.abs(then - now).max() > _ALIKE * np.abs(now).max(initial=0))


def carrying_at(linear: Equations) -> Carrying:
    """The transformation at the state of a linear model.

    Raises SceneError where the rotor is not axisymmetric, saying why.
    """
    there = later(linear)
    dt = there.state.t - linear.state.t
    turned = _turned(linear, there)
    rates = np.real(logm(turned)) / dt
    rates[np.abs(rates) < _ROUNDING * np.abs(rates).max(initial=0)] = 0.0
    carrying = Carrying(np.eye(len(linear)), rates)
    _refuse_asymmetric(replace(linear, carrying=carrying))
    return carrying


def _turned(linear: Equations, there: Equations) -> Array:
    """T (n, n) of the later state."""
    now, then = displacements(linear, linear.state), displacements(there, there.state)
    size = np.linalg.norm(now, axis=0)
    unit = now / np.where(size > 0, size, 1.0)
    singular = np.linalg.svd(unit, compute_uv=False)
    if not size.all() or singular.min(initial=np.inf) < _SEEN * singular.max(initial=0):
        raise _no_frame("displacements of its bodies' ends do not determine its coordinates")
    found = np.linalg.lstsq(unit, then, rcond=None)[0]
    left = np.abs(unit @ found - then).max(axis=0) / np.linalg.norm(then, axis=0)
    if (left > _ALIKE).any():
        names = [linear.coordinates[k] for k in np.flatnonzero(left > _ALIKE)]
        raise _no_frame(f"what {abbreviate(names)} displaces changes its shape as it turns")
    return np.asarray(found / size[:, None])


def _refuse_asymmetric(linear: Equations) -> None:
    """SceneError where the matrices of y change along the motion."""
    there = later(linear)
    scale = 1 / np.sqrt(np.abs(np.diag(linear.M)))
    mass, stiff = (_largest(one, scale) for one in (linear.M, linear.K))
    assert linear.carrying is not None
    fastest = max(np.sqrt(stiff / mass), float(np.abs(linear.carrying.rates).max()))
    for name, floor in (("M", mass), ("C", mass * fastest), ("K", mass * fastest**2)):
        one, other = (getattr(x, name) * np.outer(scale, scale) for x in (linear, there))
        rows = np.maximum(np.abs(one).max(axis=0), np.abs(one).max(axis=1))
        allowed = SAME * np.sqrt(np.outer(rows, rows)) + _ROUNDING * max(rows.max(), floor)
        wrong = np.abs(one - other) > allowed
        if wrong.any():
            names = [linear.coordinates[k] for k in np.flatnonzero(wrong.any(axis=0))]
            raise _no_frame(f"{_NAMES[name]} of {abbreviate(names)} changes as it turns")


_NAMES = {"M": "the inertia", "C": "the damping or gyroscopic load", "K": "the stiffness"}


def _largest(matrix: Array, scale: Array) -> float:
    return float(np.abs(matrix * np.outer(scale, scale)).max(initial=0))


def _no_frame(why: str) -> SceneError:
    return SceneError(f"fixed frame: the rotor is not axisymmetric: {why}")


# --- displacements --------------------------------------------------------------------------------


def displacements(linear: Equations, state: State) -> Array:
    """(rows, n): twists of all bodies and of sections of beams for a unit of each increment, of the
    point at the origin of inertial axes, which goes along with the mean motion; rotations count as
    a length of the scene."""
    length = scene_length(linear.model)
    points = _points(linear, state, linear.spread(np.eye(len(linear))).T)
    place, velocity, spin = (points[..., COLUMNS[kind]] for kind in _KINDS)
    centre = state.t * _drift(linear)
    found = np.concatenate([velocity + np.cross(spin, centre - place), length * spin], axis=1)
    return np.asarray(found.reshape(len(linear), -1).T)


def whirl(linear: Equations, shapes: NDArray[Any]) -> Array:
    """(k,) sense of the whirl of complex shapes (n, k) about the angular velocity of the body that
    spins fastest: 1 forward along a circle, -1 backward, between these along ellipses, 0 in a
    plane or along the axis."""
    axis = _spin(linear)
    rows = (displacements(linear, linear.state) @ shapes).reshape(-1, 3, shapes.shape[1])
    turned = np.cross(np.conj(rows), rows, axis=1).imag
    flat = rows - axis[:, None] * np.einsum("i,nik->nk", axis, rows)[:, None]
    area = -np.einsum("i,nik->k", axis, turned)
    size = np.einsum("nik,nik->k", np.conj(flat), flat).real
    return np.divide(area, size, out=np.zeros_like(area), where=size > 0)


_KINDS = "position", "velocity", "angular_velocity"


def _points(linear: Equations, state: State, speeds: Array) -> Array:
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
    beams = {name: body for name, body in flexible.items() if body.shapes is not None}
    frames = [points[:, names.index(name)] for name in beams]
    slots = [linear.model.layout.modal[name].u_slice for name in beams]
    along = [_sections(body, frame, speeds[:, place])
             for body, frame, place in zip(beams.values(), frames, slots, strict=True)]  # fmt: skip
    return np.concatenate([points, *along], axis=1)


def _sections(body: ModalBody, frame: Array, rates: Array) -> Array:
    """(m, sections, 24) of a beam at rates (m, modes), on its undeformed axis."""
    shapes = body.shapes
    assert shapes is not None
    x = shapes.length * (1 - np.cos(np.linspace(0, np.pi, shapes.n + 3))) / 2
    values, rotation = shapes.at(x), frame[:, 15:24].reshape(-1, 1, 3, 3)
    found = np.repeat(frame[:, None], len(x), axis=1)
    arm = rotation[..., 0] * x[:, None]
    velocity, spin = COLUMNS["velocity"], COLUMNS["angular_velocity"]
    for columns, field in ((velocity, values.phi), (spin, values.theta)):
        own = np.einsum("xik,mk->mxi", field, rates)
        found[..., columns] += np.einsum("mxij,mxj->mxi", np.broadcast_to(
            rotation, (len(frame), len(x), 3, 3)), own)  # fmt: skip
    found[..., velocity] += np.cross(frame[:, None, spin], arm)
    found[..., COLUMNS["position"]] += arm
    return found


def _drift(linear: Equations) -> Array:
    """(3,) velocity of the body that turns least, where the scene has linear momentum."""
    state, engine = linear.state, linear.model.looped
    of = np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None]
    sums = engine.observe(*of, (), parts=("sums",)).sums[0]
    points = _points(linear, state, state.u[None])[0]
    size = np.linalg.norm(points[:, COLUMNS["velocity"]], axis=1).max()
    momentum = np.linalg.norm(sums[SUMS["momentum"][2]]) * size
    if momentum <= _ALIKE * sums[SUMS["energy.kinetic"][2]]:
        return np.zeros(3)
    least = np.linalg.norm(points[:, COLUMNS["angular_velocity"]], axis=1).argmin()
    return np.asarray(points[least, COLUMNS["velocity"]])


def angular_velocity(linear: Equations, name: str) -> Array:
    """(3,) angular velocity of a body or end at the state, rad/s, inertial axes."""
    engine, state = linear.model.looped, linear.state
    of = np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None]
    probe = Probe(*linear.model.looped.packed.end(name))
    points = engine.observe(*of, [probe], parts=("points",)).points
    return np.asarray(points[0, 0, COLUMNS["angular_velocity"]])


def _spin(linear: Equations) -> Array:
    """(3,) unit vector of the largest angular velocity of a body, of the x axis without spin."""
    turns = _points(linear, linear.state, linear.state.u[None])[0, :, COLUMNS["angular_velocity"]]
    fastest = turns[np.linalg.norm(turns, axis=1).argmax()]
    size = float(np.linalg.norm(fastest))
    return np.asarray(fastest / size) if size else np.array([1.0, 0.0, 0.0])
