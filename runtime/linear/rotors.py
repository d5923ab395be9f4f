"""Rotors: multi-blade coordinates, displacements and whirl, linear models in the fixed frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import logm

from mstmm.array_validation import Array, Integers
from mstmm.display import abbreviate_names
from mstmm.errors import SceneError

from ..engine.compiled_scene import scene_length
from ..engine.looped_engine import Probe
from ..engine.quantity_registry import POINT_COLUMNS, SUMS
from ..engine.state_evaluation.kinematics import point_motions
from .mck_matrices import FrameTransform, State
from .operating_point.later_states import SAME, later_equations, later_state

if TYPE_CHECKING:
    from ..flexible.modal_body import ModalBody
    from ..packing.packed_scene import PackedScene
    from .linear_equations import LinearEquations


# --- multi-blade coordinates: three or more equal branches that spin with a hub -------------------
#
# After Coleman and Feingold (1958) a coordinate of blade k of N is a sum of harmonics of the
# azimuth of the blade,
#
#     x_k(t) = sum over h of a_h(t) exp(i h (W t + 2 pi k / N)),  |h| <= N / 2.
#
# The same sum at the azimuths of the blades at t = 0,
#
#     y_k(t) = sum over h of a_h(t) exp(2 pi i h k / N),
#
# is the pattern of the rotor in the fixed frame.  Then y' = x' + R y with a circulant R, which
# turns harmonic h at the rate -h W.  The collective component (mean of all blades) and, for even N,
# the differential component (alternating signs) are unchanged.

#: Smallest number of blades with constant coefficients in the fixed frame.
_FEWEST = 3
#: Tolerance for equal azimuths (rad) and equal distances from the axis (relative).
_EQUAL = 1e-6


@dataclass(frozen=True)
class Blades:
    """Equal branches of one hub in the order of their azimuths.

    Attributes:
        bodies: (blades, b) indices of their bodies in the tree.
        coordinates: (blades, m) indices among the perturbations of a linear model.
        speed: magnitude of the angular velocity of the hub, rad/s.
    """

    bodies: Integers
    coordinates: Integers
    speed: float

    @property
    def rates(self) -> Array:
        """Circulant R (blades, blades), 1/s, of one coordinate of all blades."""
        count = len(self.coordinates)
        k = np.arange(count)
        h = np.arange(1, (count - 1) // 2 + 1)[:, None, None]
        turns = h * np.sin(2 * np.pi * h * (k[:, None] - k) / count)
        return np.asarray(2 * self.speed / count * turns.sum(axis=0))


@dataclass(frozen=True)
class _Branch:
    """Branch with tree indices `bodies` and perturbation indices `coordinates`.

    Branches of equal `form` have the same hinges and free perturbations.
    """

    bodies: tuple[int, ...]
    coordinates: tuple[int, ...]
    form: tuple[object, ...]


def find_blades(linear: LinearEquations) -> list[Blades]:
    """Groups of equal branches on spinning hubs, equally spaced about the spin axis."""
    packed = linear.model.looped.packed
    points = _mass_centres(linear)
    blade_groups: list[Blades] = []
    for hub, link in enumerate(packed.topology.links):
        by_form: dict[tuple[object, ...], list[_Branch]] = {}
        for child in link.children if len(link.children) >= _FEWEST else ():
            branch = _branch(linear, packed, child)
            if branch.coordinates:
                by_form.setdefault(branch.form, []).append(branch)
        groups = (_arrange_blades(points, hub, group) for group in by_form.values())
        blade_groups += [group for group in groups if group is not None]
    return blade_groups


def _branch(linear: LinearEquations, packed: PackedScene, root: int) -> _Branch:
    """Branch outboard from body `root`; its form lists hinges and free perturbations in order."""
    bodies, coordinates, form = [], list[int](), list[object]()
    row_by_speed = {speed: k for k, speed in enumerate(linear.free_speed_indices)}
    for tree_index in _outwards(packed, root):
        bodies.append(tree_index)
        body, hinge = packed.topology.scene_indices(tree_index)
        of_hinge = packed.layout.hinges.get(packed.scene.hinges[hinge].name)
        of_body = packed.layout.modal.get(packed.scene.bodies.name(body))
        for slots in (of_hinge, of_body):
            free = (
                [] if slots is None else [k for k in range(slots.nu) if slots.u + k in row_by_speed]
            )
            form.append((None if slots is None else slots.type, tuple(free)))
            coordinates += [row_by_speed[slots.u + k] for k in free] if slots is not None else []
        form.append(len(packed.topology.links[tree_index].children))
    return _Branch(tuple(bodies), tuple(coordinates), tuple(form))


def _outwards(packed: PackedScene, root: int) -> Iterator[int]:
    """Tree indices of a body and all bodies outboard of it, depth first."""
    waiting = [root]
    while waiting:
        tree_index = waiting.pop()
        yield tree_index
        waiting += reversed(packed.topology.links[tree_index].children)


def _mass_centres(linear: LinearEquations) -> Array:
    """Motion of the mass centres (bodies, 24) in tree order; columns of `Observation.points`."""
    packed, state, engine = linear.model.looped.packed, linear.state, linear.model.looped
    names = [packed.scene.bodies.name(body) for body in packed.topology.order]
    probes = [Probe(packed.end(name)[0], packed.end(name)[1], packed.mass_center(name))
              for name in names]  # fmt: skip
    return point_motions(engine, probes, state.q, state.u, state.udot)


def _arrange_blades(points: Array, hub: int, group: list[_Branch]) -> Blades | None:
    """Branches ordered by azimuth about the spin axis of the hub; None if not equally spaced."""
    spin = points[hub, POINT_COLUMNS["angular_velocity"]]
    speed = float(np.linalg.norm(spin))
    if len(group) < _FEWEST or not speed:
        return None
    axis = spin / speed
    across = np.linalg.svd(axis[None])[2][1:]
    across[1] = np.cross(axis, across[0])
    means = np.array([points[list(branch.bodies), :3].mean(axis=0) for branch in group])
    plane = (means - means.mean(axis=0)) @ (across.T @ [1, 1j])
    radius, order = np.abs(plane), np.argsort(np.angle(plane))
    steps = np.angle(plane[np.roll(order, -1)] / plane[order]) if radius.all() else np.zeros(1)
    even = np.abs(steps - 2 * np.pi / len(group)).max() <= _EQUAL
    if not even or np.ptp(radius) > _EQUAL * radius.max():
        return None
    bodies, coordinates = (
        np.array([getattr(group[k], name) for k in order]) for name in ("bodies", "coordinates")
    )
    return Blades(bodies, coordinates, speed)


# --- displacements of bodies, and whirl -----------------------------------------------------------

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
    momentum = np.linalg.norm(sums[SUMS["momentum"].columns]) * size
    if momentum <= _NO_DRIFT * sums[SUMS["energy.kinetic"].columns]:
        return np.zeros(3)
    least = np.linalg.norm(points[:, POINT_COLUMNS["angular_velocity"]], axis=1).argmin()
    return np.asarray(points[least, POINT_COLUMNS["velocity"]])


def angular_velocity(linear: LinearEquations, name: str) -> Array:
    """Angular velocity (3,) of a body or end at the operating point, rad/s, inertial axes."""
    engine, state = linear.model.looped, linear.state
    probe = Probe(*engine.packed.end(name))
    points = point_motions(engine, [probe], state.q, state.u, state.udot)
    return np.asarray(points[0, POINT_COLUMNS["angular_velocity"]])


def _spin_axis(linear: LinearEquations) -> Array:
    """Unit vector (3,) of the largest angular velocity of a body; the x axis without spin."""
    turns = _points(linear, linear.state, linear.state.u[None])[
        0, :, POINT_COLUMNS["angular_velocity"]
    ]
    fastest = turns[np.linalg.norm(turns, axis=1).argmax()]
    size = float(np.linalg.norm(fastest))
    return np.asarray(fastest / size) if size else np.array([1.0, 0.0, 0.0])


# --- linear models in the fixed frame -------------------------------------------------------------
#
# Perturbations x of coordinates outboard of a spinning hinge rotate with the rotor.  At steady spin
# their displacements in inertial axes, twists d = P(t) x of all bodies, rotate too.  Where P(t) =
# P(0) T(t) with T(t) = exp(W t), the perturbations in the fixed frame are y = T x, with d = P(0) y.
# They obey
#
#     M y'' + (C - 2 M W) y' + (K - C W + M W^2) y = inputs,
#
# with the matrices of x at t = 0.  The coefficients are constant for axisymmetric rotors on any
# supports: T^-T M(t) T^-1 = M(0), and likewise for C and K.  Both conditions are checked at a later
# state of the motion.  Coordinates of three or more equal blades use the W of multi-blade
# coordinates.

#: Relative tolerance for equal displacements; relative size of matrix entries that are rounding.
_ALIKE, _ROUNDING = 1e-7, 1e-11
#: Relative singular value of displacements below which a perturbation is unobservable.
_OBSERVABLE = 1e-9


def frame_of(linear: LinearEquations) -> str:
    """Frame of the perturbations: "rotating" if they rotate with spinning bodies, else "fixed"."""
    return "rotating" if _is_rotating(linear) else "fixed"


def _is_rotating(linear: LinearEquations) -> bool:
    if linear.frame_transform is not None or not len(linear) or not linear.state.u.any():
        return False
    now, then = (displacements(linear, state) for state in (linear.state, later_state(linear)))
    return bool(np.abs(then - now).max() > _ALIKE * np.abs(now).max(initial=0))


def fixed_frame_transform(linear: LinearEquations) -> FrameTransform:
    """Transformation to the fixed frame at the operating point of a linear model.

    Raises SceneError with the reason where the rotor is not axisymmetric.
    """
    there = later_equations(linear)
    dt = there.state.t - linear.state.t
    blades, rates = find_blades(linear), np.zeros((len(linear), len(linear)))
    is_outside_blades = np.ones(len(linear), dtype=bool)
    for group in blades:
        is_outside_blades[group.coordinates] = False
        for blade_columns in group.coordinates.T:
            rates[np.ix_(blade_columns, blade_columns)] = group.rates
    if is_outside_blades.any():
        turned = _later_rotation(linear, there, np.flatnonzero(is_outside_blades))
        rates[np.ix_(is_outside_blades, is_outside_blades)] = np.real(logm(turned)) / dt
    rates[np.abs(rates) < _ROUNDING * np.abs(rates).max(initial=0)] = 0.0
    carrying = FrameTransform(np.eye(len(linear)), rates)
    _check_constant_matrices(replace(linear, frame_transform=carrying))
    return carrying


def _later_rotation(
    linear: LinearEquations, there: LinearEquations, perturbations: Integers
) -> Array:
    """T (m, m) at the later state `there`, for `perturbations` (m,) outside blades."""
    now = displacements(linear, linear.state)[:, perturbations]
    then = displacements(there, there.state)[:, perturbations]
    size = np.linalg.norm(now, axis=0)
    unit = now / np.where(size > 0, size, 1.0)
    singular = np.linalg.svd(unit, compute_uv=False)
    if not size.all() or singular.min(initial=np.inf) < _OBSERVABLE * singular.max(initial=0):
        raise _no_frame("displacements of its bodies' ends do not determine its coordinates")
    rotation = np.linalg.lstsq(unit, then, rcond=None)[0]
    left = np.abs(unit @ rotation - then).max(axis=0) / np.linalg.norm(then, axis=0)
    if (left > _ALIKE).any():
        names = [linear.coordinate_names[k] for k in perturbations[left > _ALIKE]]
        raise _no_frame(
            f"the displacements by {abbreviate_names(names)} change their shape during rotation"
        )
    return np.asarray(rotation / size[:, None])


def _check_constant_matrices(linear: LinearEquations) -> None:
    """Raise SceneError where the matrices of y change along the motion."""
    there = later_equations(linear)
    scale = 1 / np.sqrt(np.abs(np.diag(linear.M)))
    mass, stiff = (_largest(matrix, scale) for matrix in (linear.M, linear.K))
    assert linear.frame_transform is not None
    fastest = max(np.sqrt(stiff / mass), float(np.abs(linear.frame_transform.rates).max()))
    for name, floor in (("M", mass), ("C", mass * fastest), ("K", mass * fastest**2)):
        now, then = (getattr(x, name) * np.outer(scale, scale) for x in (linear, there))
        rows = np.maximum(np.abs(now).max(axis=0), np.abs(now).max(axis=1))
        allowed = SAME * np.sqrt(np.outer(rows, rows)) + _ROUNDING * max(rows.max(), floor)
        wrong = np.abs(now - then) > allowed
        if wrong.any():
            names = [linear.coordinate_names[k] for k in np.flatnonzero(wrong.any(axis=0))]
            raise _no_frame(f"{_NAMES[name]} of {abbreviate_names(names)} changes during rotation")


_NAMES = {"M": "the inertia", "C": "the damping or gyroscopic load", "K": "the stiffness"}


def _largest(matrix: Array, scale: Array) -> float:
    return float(np.abs(matrix * np.outer(scale, scale)).max(initial=0))


def _no_frame(why: str) -> SceneError:
    return SceneError(
        f"fixed frame: the rotor is not axisymmetric and has no three or more equal blades: {why}"
    )
