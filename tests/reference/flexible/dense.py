"""Rigid and flexible bodies as one dense saddle-point system, from particles.

Unknowns: acceleration of every floating frame and of the modes, the wrench of every hinge at its
outboard point, the rates of the hinges' speeds.  Ports and hinges are written as positions in
Taylor arithmetic alone, so that no Jacobian and no bias is stated by hand; sections turn by
exp(Psi~).

The inertia of a body comes in two forms.  `particles`: J^T rho J and J^T rho Jdot ydot of the whole
second-order field.  `lagrangian` (what invariants of second order give): kinetic energy cut after
the second order in the modes, then Lagrange's equations in quasi-velocities.  Without stiffening
both are the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from tests.reference import hinges as kinematics
from tests.reference import laws
from tests.reference.algebra import tilde
from tests.reference.jets import Array, Jet, apply, chain, dot
from tests.reference.tree import Hinge, Tree, read

from .beam import Body, Particles, Section, flexible_body, mean_section, rigid_body


@dataclass(frozen=True)
class State:
    """Attitude, origin, angular velocity, velocity of a frame (inertial axes); its modes."""

    A: Array
    r: Array
    w: Array
    v: Array
    eta: Array
    etad: Array


@dataclass(frozen=True)
class Accelerations:
    """udot (nu,) in the order of u; per hinge, load of the inboard on the outboard side at the
    outboard point, inertial axes."""

    udot: Array
    force: Array
    moment: Array


@dataclass(frozen=True)
class System:
    """A scene as bodies with shapes and a tree of hinges."""

    tree: Tree
    bodies: tuple[Body, ...]
    flexible: tuple[int, ...]
    lagrangian: bool
    loads: tuple[Mapping[str, Any], ...]
    beams: Mapping[str, Mapping[str, Any]]
    #: Names of the inboard and outboard end of every hinge.
    ends: tuple[tuple[str, str], ...]

    @property
    def modal(self) -> dict[int, slice]:
        """Modal coordinates of each flexible body, counted from the last hinge's."""
        out, at = {}, 0
        for i in self.flexible:
            out[i] = slice(at, at + self.bodies[i].n)
            at += self.bodies[i].n
        return out


def system(scene: Mapping[str, Any] | System, lagrangian: bool = True) -> System:
    """Read a scene with [[body]], [[beam]] (shapes of its own), [[hinge]] and loads; a system that
    has been read stays as it is."""
    if isinstance(scene, System):
        return scene
    beams = list(scene.get("beam") or ())
    held = {}
    for hinge in scene["hinge"]:
        name, _, end = hinge["outboard"].partition(".")
        held[name] = end or "root"
    flexible = [flexible_body(beam, held[beam["name"]]) for beam in beams]
    rigid = [rigid_body(body) for body in scene.get("body") or ()]
    stand_ins = [_stand_in(beam) for beam in beams]
    plain = {**scene, "body": [*(scene.get("body") or ()), *stand_ins], "load": []}
    numbers = tuple(range(len(rigid), len(rigid) + len(flexible)))
    bodies = (*rigid, *flexible)
    ends = tuple(
        (hinge["inboard"].partition(".")[2], hinge["outboard"].partition(".")[2])
        for hinge in scene["hinge"]
    )
    loads = tuple(scene.get("load") or ())
    named = {beam["name"]: beam for beam in beams}
    return System(read(plain), bodies, numbers, lagrangian, loads, named, ends)


def _stand_in(beam: Mapping[str, Any]) -> dict[str, Any]:
    """The names of a beam's ends, for the reader of hinges."""
    ends: dict[str, Any] = {"root": [0, 0, 0], "tip": [beam["length"], 0, 0]}
    for name, end in (beam.get("ends") or {}).items():
        if isinstance(end, Mapping):
            ends[name] = {**end, "position": [end["position"], 0, 0]}
        else:
            ends[name] = [end, 0, 0]
    return {"name": beam["name"], "mass": 1.0, "inertia": [1.0, 1.0, 1.0], "ends": ends}


def exponential(psi: Jet) -> Jet:
    """exp(psi~), psi (..., 3), by the power series of sin(p)/p and (1 - cos p)/p^2 in p^2."""
    square = dot(psi, psi)
    sine = chain(square, lambda s: _series(s, 1))[..., None, None]
    cosine = chain(square, lambda s: _series(s, 2))[..., None, None]
    cross = Jet(tilde(psi.x), tilde(psi.dx), tilde(psi.ddx))
    return np.eye(3) + sine * cross + cosine * (cross @ cross)


def _series(s: Array, start: int) -> tuple[Array, Array, Array]:
    """sum (-s)^k / (2 k + start)! and its derivatives."""
    terms = np.array([(-1.0) ** k / float(_factorial(2 * k + start)) for k in range(14)])
    series = np.polynomial.Polynomial(terms)
    return series(s), series.deriv()(s), series.deriv(2)(s)


def _factorial(n: int) -> int:
    return 1 if n < 2 else n * _factorial(n - 1)


def section_jet(section: Section, eta: Jet) -> tuple[Jet, Jet]:
    """Place and attitude of a section in frame axes."""
    place = apply(section.phi, eta) + section.place
    place = place + _quadratic_term(section.second[:3], eta)
    turn = apply(section.theta, eta) + _quadratic_term(section.second[3:], eta)
    return place, exponential(turn) @ section.rotation


def _quadratic_term(second: Array, eta: Jet) -> Jet:
    """1/2 eta^T second eta (..., 3)."""
    x, y, z = ((dot(eta, apply(part, eta)) * 0.5)[..., None] for part in second)
    axes = np.eye(3)
    return x * axes[0] + y * axes[1] + z * axes[2]


def frame_jet(state: State, a: Array, alpha: Array) -> tuple[Jet, Jet]:
    """Origin and attitude of a frame with accelerations (..., 3)."""
    w = tilde(state.w)
    A = Jet(
        np.broadcast_to(state.A, (*a.shape, 3)),
        np.broadcast_to(w @ state.A, (*a.shape, 3)),
        (tilde(alpha) + w @ w) @ state.A,
    )
    return Jet(np.broadcast_to(state.r, a.shape), np.broadcast_to(state.v, a.shape), a), A


def end_jet(body: Body, end: str, state: State, y: Array) -> tuple[Jet, Jet]:
    """Place and attitude of an end for accelerations y = (a, alpha, etadd), (..., 6 + n)."""
    return section_motion(body.ends[end], state, y)


def section_motion(section: Section, state: State, y: Array) -> tuple[Jet, Jet]:
    """Place and attitude of a section for accelerations y = (a, alpha, etadd), (..., 6 + n)."""
    origin, A = frame_jet(state, y[..., :3], y[..., 3:6])
    shape = y[..., 6:].shape
    eta = Jet(np.broadcast_to(state.eta, shape), np.broadcast_to(state.etad, shape), y[..., 6:])
    place, turned = section_jet(section, eta)
    return origin + apply(A, place), A @ turned


GROUND = State(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(0), np.zeros(0))


def _inboard(system: System, number: int, states: Mapping[int, State], y: Array) -> Any:
    hinge, tree = system.tree.hinges[number], system.tree
    end = system.ends[number][0]
    if hinge.parent < 0:
        origin, A = frame_jet(GROUND, y[..., :3], y[..., 3:6])
        return origin + apply(A, hinge.ro), A @ hinge.Ro
    body = system.bodies[hinge.parent]
    place, attitude = end_jet(body, end, states[hinge.parent], y)
    # Ro of the tree is the end's own attitude times the hinge's orientation.
    own = tree.bodies[hinge.parent].ends[end][1] if end else np.eye(3)
    return place, attitude @ (own.T @ hinge.Ro)


def predicted_pose(
    system: System,
    number: int,
    states: Mapping[int, State],
    y: Array,
    q: Array,
    u: Array,
    du: Array,
) -> tuple[Jet, Jet]:
    """Place and attitude of a hinge's outboard end by its inboard end and its coordinates."""
    hinge = system.tree.hinges[number]
    place, frame = _inboard(system, number, states, y)
    speeds = np.broadcast_to(u[hinge.u], du.shape)
    rotation, d = kinematics.pose(hinge, kinematics.coordinate_jet(hinge, q[hinge.q], speeds, du))
    return place + apply(frame, d), frame @ rotation


def motion(system: System, q: Array, u: Array) -> dict[int, State]:
    """State of every floating frame."""
    tree = system.tree
    states: dict[int, State] = {}
    etas, etads = q[tree.nq :], u[tree.nu :]
    for number in tree.order:
        hinge = tree.hinges[number]
        n = 0 if hinge.parent < 0 else system.bodies[hinge.parent].n
        y, du = np.zeros((1, 6 + n)), np.zeros((1, hinge.u.stop - hinge.u.start))
        place, attitude = predicted_pose(system, number, states, y, q, u, du)
        own = system.modal.get(hinge.child, slice(0, 0))
        eta, etad = etas[own], etads[own]
        end = system.bodies[hinge.child].ends[system.ends[number][1]]
        at, turned = section_jet(end, Jet(eta[None], etad[None], np.zeros((1, len(eta)))))
        A = attitude @ turned.transpose
        r = place - apply(A, at)
        w = kinematics.angular(A).x[0]
        states[hinge.child] = State(A.x[0], r.x[0], w, r.dx[0], eta, etad)
    return states


def _modes(body: Body, eta: Array) -> tuple[Array, Array, Array]:
    """J0, J1(eta), J2(eta) (m, 3, 6 + n): velocities of the particles from (v, w, etad) in body
    axes by order in the modes."""
    return modes_of(body.particles, eta)


def modes_of(p: Particles, eta: Array) -> tuple[Array, Array, Array]:
    """The same for any particles that move with the shapes."""
    count, n = len(p.mass), len(eta)
    first = p.phi @ eta
    second = 0.5 * np.einsum("makl,k,l->ma", p.second, eta, eta)
    J = [np.zeros((count, 3, 6 + n), dtype=second.dtype) for _ in range(3)]
    J[0][:, :, :3] = np.eye(3)
    for order, arm in enumerate((p.place, first, second)):
        J[order][:, :, 3:6] = -_cross(arm)
    J[1][:, :, 6:] = p.phi
    J[2][:, :, 6:] = p.second @ eta
    return J[0], J[1], J[2]


def _cross(a: Array) -> Array:
    out = np.zeros((len(a), 3, 3), dtype=a.dtype)
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -a[:, 2], a[:, 1], -a[:, 0]
    return out - np.swapaxes(out, 1, 2)


def mass_matrix(body: Body, eta: Array, lagrangian: bool) -> Array:
    """(6 + n, 6 + n) in body axes."""
    return moments(body.particles, eta, lagrangian)


def moments(p: Particles, eta: Array, lagrangian: bool) -> Array:
    """sum m J^T J, cut after the second order in the modes or not."""
    J0, J1, J2 = modes_of(p, eta)

    def product(a: Array, b: Array) -> Array:
        return np.einsum("m,mai,maj->ij", p.mass, a, b)

    if not lagrangian:
        J = J0 + J1 + J2
        return product(J, J)
    cross = product(J0, J1 + J2)
    return product(J0, J0) + cross + cross.T + product(J1, J1)


def bias(body: Body, state: State, lagrangian: bool) -> Array:
    """Inertia forces at zero (a, alpha, etadd), body axes (6 + n,)."""
    w, n = state.A.T @ state.w, body.n
    y = np.concatenate([np.zeros(3), w, state.etad])
    if not lagrangian:
        p = body.particles
        J0, J1, J2 = _modes(body, state.eta)
        J = J0 + J1 + J2
        place = p.place + p.phi @ state.eta
        place += 0.5 * np.einsum("makl,k,l->ma", p.second, state.eta, state.eta)
        moving = J[:, :, 6:] @ state.etad
        acceleration = np.cross(w, np.cross(w, place)) + 2 * np.cross(w, moving)
        acceleration += np.einsum("makl,k,l->ma", p.second, state.etad, state.etad)
        return np.einsum("m,mai,ma->i", p.mass, J, acceleration)
    M = mass_matrix(body, state.eta, True)
    step: Any = 1e-30j * np.eye(n)
    rates = [mass_matrix(body, state.eta + step[k], True).imag / 1e-30 for k in range(n)]
    momentum = M @ y
    out = sum((rate * state.etad[k] for k, rate in enumerate(rates)), np.zeros_like(M)) @ y
    out[:3] += np.cross(w, momentum[:3])
    out[3:6] += np.cross(w, momentum[3:6])
    out[6:] -= [0.5 * y @ rate @ y for rate in rates]
    return out


def kinetic_energy(body: Body, state: State, lagrangian: bool) -> float:
    """Kinetic energy of one body."""
    y = np.concatenate([state.A.T @ state.v, state.A.T @ state.w, state.etad])
    return 0.5 * float(y @ mass_matrix(body, state.eta, lagrangian) @ y)


def _block_rotation(A: Array, n: int) -> Array:
    return scipy.linalg.block_diag(A, A, np.eye(n)) if n else scipy.linalg.block_diag(A, A)


def _affine(place: Jet, attitude: Jet) -> tuple[Array, Array]:
    """Matrix and bias of (acceleration, angular acceleration) from a batch whose first entry has
    zero accelerations and whose others are units."""
    second = np.concatenate([place.ddx, kinematics.angular(attitude).dx], axis=-1)
    return (second[1:] - second[0]).T, second[0]


def _units(n: int) -> Array:
    return np.vstack([np.zeros((1, n)), np.eye(n)])


def solve(
    scene: Mapping[str, Any],
    q: Array,
    u: Array,
    t: float = 0.0,
    lagrangian: bool = True,
    meeting: Sequence[tuple[str, str]] = (),
) -> Accelerations:
    """Accelerations and hinge loads at one state; q, u: hinges in scene order, then modes.

    Ends that are `meeting` ("body.end", or "ground" for where the other is) stay in one place.
    """
    this = system(scene, lagrangian)
    q, u = np.asarray(q, float), np.asarray(u, float)
    tree, states = this.tree, motion(this, q, u)
    sizes = [6 + body.n for body in this.bodies]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    hinges, total = len(tree.hinges), int(starts[-1])
    count = total + 6 * hinges + tree.nu
    matrix = np.zeros((count + 3 * len(meeting),) * 2)
    right = np.zeros(len(matrix))
    for i, body in enumerate(this.bodies):
        rows = slice(starts[i], starts[i + 1])
        matrix[rows, rows], right[rows] = _body_rows(this, body, states[i])
    for load in this.loads:
        i, force = _load(this, load, states)
        right[starts[i] : starts[i + 1]] += force
    for j, hinge in enumerate(tree.hinges):
        at = slice(total + 6 * j, total + 6 * j + 6)
        own = slice(total + 6 * hinges + hinge.u.start, total + 6 * hinges + hinge.u.stop)
        _hinge_rows(this, j, states, q, u, matrix, right, at, own, starts)
        right[own] += laws.hinge_effort(tree, hinge, q[: tree.nq], u[: tree.nu], t)
        matrix[own, own] += np.diag(laws.reflected_inertia(hinge))
    for k, ends in enumerate(meeting):
        at = slice(count + 3 * k, count + 3 * k + 3)
        for sign, (i, J, b) in _moving(this, ends, states):
            rows = slice(starts[i], starts[i + 1])
            matrix[at, rows] += sign * J
            matrix[rows, at] += sign * J.T
            right[at] -= sign * b
    x = _refined_solution(matrix, right)
    modes = [x[starts[i] + 6 : starts[i + 1]] for i in this.flexible]
    wrenches = x[total : total + 6 * hinges].reshape(hinges, 6)
    speeds = x[total + 6 * hinges : count]
    return Accelerations(np.concatenate([speeds, *modes]), wrenches[:, :3], wrenches[:, 3:])


def _moving(
    this: System, ends: Sequence[str], states: Mapping[int, State]
) -> Iterator[tuple[int, tuple[int, Array, Array]]]:
    """Sign, body, matrix and bias of the accelerations of those ends that move."""
    for sign, name in zip((1, -1), ends, strict=True):
        if name != "ground":
            body, _, end = name.partition(".")
            i = this.tree.body_number(body)
            moved = end_jet(this.bodies[i], end, states[i], _units(6 + this.bodies[i].n))
            J, b = _affine(*moved)
            yield sign, (i, J[:3], b[:3])


def end_motion(
    scene: Mapping[str, Any] | System, name: str, q: Array, u: Array
) -> tuple[Array, Array]:
    """Place and velocity of an end ("body.end")."""
    this = system(scene)
    body, _, end = name.partition(".")
    i = this.tree.body_number(body)
    still = np.zeros((1, 6 + this.bodies[i].n))
    place, _ = end_jet(this.bodies[i], end, motion(this, q, u)[i], still)
    return place.x[0], place.dx[0]


def _load(this: System, load: Mapping[str, Any], states: Mapping[int, State]) -> tuple[int, Array]:
    """Number of the body and force on its frame and modes of a load with constant entries."""
    name, _, end = load["on"].partition(".")
    i = this.tree.body_number(name)
    body, state = this.bodies[i], states[i]
    section, factor = body.ends.get(end), 1.0
    if "force_per_length" in load:
        beam = this.beams[name]
        first, last = load.get("span", (0.0, beam["length"]))
        section, factor = mean_section(body, beam, first, last), last - first
    assert section is not None
    J, _ = _affine(*section_motion(section, state, _units(6 + body.n)))
    force = np.asarray(load.get("force_per_length", load.get("force", (0, 0, 0))), float)
    wrench = np.concatenate([factor * force, load.get("moment", (0, 0, 0))])
    if load.get("axes") == "body":
        turned = state.A
        if "force_per_length" not in load:
            _, attitude = section_motion(section, state, np.zeros((1, 6 + body.n)))
            turned = attitude.x[0] @ section.rotation.T
        wrench = scipy.linalg.block_diag(turned, turned) @ wrench
    return i, J.T @ wrench


def _body_rows(this: System, body: Body, state: State) -> tuple[Array, Array]:
    M = mass_matrix(body, state.eta, this.lagrangian)
    h = bias(body, state, this.lagrangian) - M[:, :3] @ (state.A.T @ this.tree.gravity)
    h[6:] += body.K @ state.eta + body.D @ state.etad
    if body.drag is not None:
        speeds = np.concatenate([state.A.T @ state.v, state.A.T @ state.w, state.etad])
        h += moments(body.drag, state.eta, this.lagrangian) @ speeds
    T = _block_rotation(state.A, body.n)
    return T @ M @ T.T, -T @ h


def _hinge_rows(
    this: System,
    j: int,
    states: Mapping[int, State],
    q: Array,
    u: Array,
    matrix: Array,
    right: Array,
    at: slice,
    own: slice,
    starts: Array,
) -> None:
    """outboard end's acceleration = predicted one, and the multipliers in the bodies' rows."""
    hinge: Hinge = this.tree.hinges[j]
    p, c = hinge.parent, hinge.child
    end = this.ends[j][1]
    n = 6 + (this.bodies[p].n if p >= 0 else 0)
    count = hinge.u.stop - hinge.u.start
    batch = _units(n + count)
    J, b = _affine(*predicted_pose(this, j, states, batch[:, :n], q, u, batch[:, n:]))
    Jc, bc = _affine(*end_jet(this.bodies[c], end, states[c], _units(6 + this.bodies[c].n)))
    child = slice(starts[c], starts[c + 1])
    matrix[at, child] += Jc
    matrix[child, at] -= Jc.T
    if p >= 0:
        parent = slice(starts[p], starts[p + 1])
        matrix[at, parent] -= J[:, :n]
        matrix[parent, at] += J[:, :n].T
    matrix[at, own] -= J[:, n:]
    matrix[own, at] += J[:, n:].T
    right[at] = b - bc


def _refined_solution(matrix: Array, right: Array) -> Array:
    """Solution of the equilibrated system, refined with residuals in extended precision."""
    scale_c = 1.0 / np.abs(matrix).max(axis=0)
    scale_r = 1.0 / np.abs(matrix * scale_c).max(axis=1)
    scaled = scale_r[:, None] * matrix * scale_c
    factors = scipy.linalg.lu_factor(scaled)
    wide_m, wide_r = scaled.astype(np.longdouble), (scale_r * right).astype(np.longdouble)
    x = scipy.linalg.lu_solve(factors, scale_r * right).astype(np.longdouble)
    for _ in range(2):
        x = x + scipy.linalg.lu_solve(factors, np.asarray(wide_r - wide_m @ x, float))
    return np.asarray(x * scale_c, float)


def energy(scene: Mapping[str, Any] | System, q: Array, u: Array, lagrangian: bool = True) -> float:
    """Kinetic energy, gravity (zero at the origin), strain energy and springs of hinges."""
    this = system(scene, lagrangian)
    states = motion(this, np.asarray(q, float), np.asarray(u, float))
    total = sum(laws.hinge_potential(h, np.asarray(q)[: this.tree.nq]) for h in this.tree.hinges)
    for i, body in enumerate(this.bodies):
        state, p = states[i], body.particles
        total += kinetic_energy(body, state, this.lagrangian)
        total += 0.5 * float(state.eta @ body.K @ state.eta)
        place = p.place + p.phi @ state.eta
        place += 0.5 * np.einsum("makl,k,l->ma", p.second, state.eta, state.eta)
        total -= float(this.tree.gravity @ (p.mass @ (state.r + place @ state.A.T)))
    return float(total)


def end_place(scene: Mapping[str, Any], q: Array, u: Array, where: str) -> Array:
    """Place of an end in inertial axes."""
    this = system(scene)
    states = motion(this, np.asarray(q, float), np.asarray(u, float))
    name, _, end = where.partition(".")
    i = this.tree.body_number(name)
    place, _ = end_jet(this.bodies[i], end, states[i], np.zeros((1, 6 + this.bodies[i].n)))
    return np.asarray(place.x[0])


__all__ = ["end_place", "energy", "solve", "system"]
