"""Dense Newton-Euler equations of a tree: all accelerations and hinge wrenches in one system.

Unknowns: accelerations of the mass centres and angular accelerations (6 N), the wrench of every
hinge at its outboard point P (6 N) and the rates of the speeds.  Equations, in inertial axes:
Newton and Euler about every mass centre; twice differentiated position of every hinge (by Taylor
arithmetic, not by a motion subspace); the law of every speed, by virtual power.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg

from . import hinges as kinematics
from . import laws
from .algebra import tilde
from .expressions import drive
from .jets import Array
from .tree import Hinge, Tree, read


@dataclass(frozen=True)
class Relative:
    """Motion of a hinge, hinge frame: d and R; rate columns B (6, nu) and bias (6,) of
    (d'', relative angular acceleration) = B udot + bias; rates (6,) of (d', omega_rel)."""

    d: Array
    R: Array
    rates: Array
    B: Array
    bias: Array


@dataclass(frozen=True)
class Accelerations:
    """Solution: udot (nu,); per body, inertial axes, acceleration of the mass centre and angular
    acceleration; per hinge, load of the inboard on the outboard side at P, inertial axes; effort
    of every speed (nu,) as the hinge transmits it."""

    udot: Array
    center: Array
    angular: Array
    force: Array
    moment: Array
    effort: Array


def relative(hinge: Hinge, q: Array, u: Array) -> Relative:
    """Relative pose, rates and accelerations of a hinge, affine in udot, by Taylor arithmetic."""
    own_q, own_u = q[hinge.q], u[hinge.u]
    count = len(own_u)
    speeds = np.vstack([own_u, np.tile(own_u, (count, 1))]).reshape(count + 1, count)
    rates = np.vstack([np.zeros((1, count)), np.eye(count)])
    coordinates = kinematics.coordinate_jet(hinge, own_q, speeds, rates)
    rotation, d = kinematics.pose(hinge, coordinates)
    omega = kinematics.angular(rotation)
    second = np.concatenate([d.ddx, omega.dx], axis=-1)
    return Relative(
        d=d.x[0],
        R=rotation.x[0],
        rates=np.concatenate([d.dx[0], omega.x[0]]),
        B=(second[1:] - second[0]).T,
        bias=second[0],
    )


def motion(scene: Mapping[str, Any] | Tree, q: Array, u: Array) -> laws.Motion:
    """Pose and velocity of every body."""
    tree = read(scene)
    out = laws.Motion(tree)
    for number in tree.order:
        hinge = tree.hinges[number]
        rel = relative(hinge, q, u)
        frame = out.A[hinge.parent] @ hinge.Ro
        turning = out.w[hinge.parent] + frame @ rel.rates[3:]
        arm = frame @ rel.d
        at_p = out.point(hinge.parent, hinge.ro) + arm
        speed = out.velocity(hinge.parent, hinge.ro) + np.cross(out.w[hinge.parent], arm)
        speed = speed + frame @ rel.rates[:3]
        rotation = frame @ rel.R @ hinge.Rp.T
        back = rotation @ hinge.rp
        out.A[hinge.child], out.w[hinge.child] = rotation, turning
        out.r[hinge.child], out.v[hinge.child] = at_p - back, speed - np.cross(turning, back)
    return out


def _drive_accelerations(tree: Tree, t: float) -> dict[int, float]:
    rates = {}
    for hinge in tree.hinges:
        for i, text in enumerate(hinge.drive):
            if text != "free":
                rates[hinge.u.start + i] = drive(text, t)[2]
    return rates


def fill_driven(scene: Mapping[str, Any] | Tree, q: Array, u: Array, t: float) -> None:
    """Write value and rate of every driven coordinate into q and u."""
    tree = read(scene)
    for hinge in tree.hinges:
        for i, text in enumerate(hinge.drive):
            if text != "free":
                q[hinge.q.start + i], u[hinge.u.start + i] = drive(text, t)[:2]


class _System:
    """Rows and columns of the dense system; behind the speeds multipliers of couplings."""

    def __init__(self, tree: Tree, couplings: int = 0) -> None:
        self.bodies, self.hinges = len(tree.bodies), len(tree.hinges)
        self.behind = 6 * self.bodies + 6 * self.hinges + tree.nu
        size = self.behind + couplings
        self.matrix, self.right = np.zeros((size, size)), np.zeros(size)

    def body(self, i: int) -> slice:
        return slice(6 * i, 6 * i + 6)

    def hinge(self, j: int) -> slice:
        return slice(6 * (self.bodies + j), 6 * (self.bodies + j) + 6)

    def speeds(self, hinge: Hinge) -> slice:
        start = 6 * (self.bodies + self.hinges)
        return slice(start + hinge.u.start, start + hinge.u.stop)


def _newton_euler(tree: Tree, at: laws.Motion, system: _System, external: Array) -> None:
    for i, body in enumerate(tree.bodies):
        rows = system.body(i)
        inertia = at.A[i] @ body.inertia @ at.A[i].T
        system.matrix[rows, rows] = scipy.linalg.block_diag(body.mass * np.eye(3), inertia)
        system.right[rows] = external[i]
        system.right[rows][3:] -= np.cross(at.w[i], inertia @ at.w[i])


def _hinge_rows(tree: Tree, at: laws.Motion, system: _System, number: int, rel: Relative) -> None:
    """Wrench columns in the bodies' rows and the acceleration rows of one hinge.

    a_P = a_Q + alpha_Q x D + w_Q x (w_Q x D) + 2 w_Q x D' + D'',  alpha_P = alpha_Q
    + w_Q x w_rel + w_rel', with D the vector from Q to P, its rates in the hinge frame.
    """
    hinge = tree.hinges[number]
    p, c = hinge.parent, hinge.child
    rows, speeds = system.hinge(number), system.speeds(hinge)
    frame = at.A[p] @ hinge.Ro
    both = scipy.linalg.block_diag(frame, frame)
    w, D = at.w[p], frame @ rel.d
    drift, spin = frame @ rel.rates[:3], frame @ rel.rates[3:]
    arm = at.point(c, hinge.rp) - at.point(c, tree.bodies[c].center)
    system.matrix[system.body(c), rows] -= _shift(arm).T
    system.matrix[rows, system.body(c)] += _shift(arm)
    system.matrix[rows, speeds] -= both @ rel.B
    wc = at.w[c]
    right = both @ rel.bias
    right[:3] += 2 * np.cross(w, drift) - np.cross(wc, np.cross(wc, arm))
    right[3:] += np.cross(w, spin)
    if p >= 0:
        arm = at.point(p, hinge.ro) + D - at.point(p, tree.bodies[p].center)
        system.matrix[system.body(p), rows] += _shift(arm).T
        system.matrix[rows, system.body(p)] -= _shift(arm)
        right[:3] += np.cross(w, np.cross(w, arm))
    system.right[rows] += right


def _shift(arm: Array) -> Array:
    """(a_C; alpha) to acceleration of the point at `arm` from the mass centre, no bias."""
    out = np.eye(6)
    out[:3, 3:] = -tilde(arm)
    return out


def solve(
    scene: Mapping[str, Any] | Tree,
    q: Array,
    u: Array,
    t: float = 0.0,
    udot: Array | None = None,
    coupled: tuple[Array, Array] | None = None,
) -> Accelerations:
    """Accelerations and hinge wrenches at one state; `coupled` are rows C udot + drift = 0.

    With `udot` given the motion is prescribed instead and `effort` is what it needs of every
    speed (inverse dynamics; laws do not enter).
    """
    tree = read(scene)
    q, u = np.array(q, float), np.array(u, float)
    fill_driven(tree, q, u, t)
    at, system = motion(tree, q, u), _System(tree, 0 if coupled is None else len(coupled[1]))
    _newton_euler(tree, at, system, laws.external_wrenches(tree, at, q, u, t))
    driven = _drive_accelerations(tree, t)
    powers = []
    for j, hinge in enumerate(tree.hinges):
        rel = relative(hinge, q, u)
        _hinge_rows(tree, at, system, j, rel)
        frame = at.A[hinge.parent] @ hinge.Ro
        powers.append((scipy.linalg.block_diag(frame, frame) @ rel.B).T)
        rows = system.speeds(hinge)
        system.matrix[rows, system.hinge(j)] = powers[-1]
        system.matrix[rows, rows] = np.diag(laws.reflected_inertia(hinge))
        system.right[rows] = laws.hinge_effort(tree, hinge, q, u, t)
    start = system.behind - tree.nu
    if coupled is not None:
        system.matrix[start : system.behind, system.behind :] = coupled[0].T
        system.matrix[system.behind :, start : system.behind] = coupled[0]
        system.right[system.behind :] = -coupled[1]
    prescribed = driven if udot is None else dict(enumerate(udot))
    for i, value in prescribed.items():
        system.matrix[start + i] = 0.0
        system.matrix[start + i, start + i] = 1.0
        system.right[start + i] = value
    return _unpack(tree, system, powers)


def _unpack(tree: Tree, system: _System, powers: list[Array]) -> Accelerations:
    x = _refined_solution(system.matrix, system.right)
    n, h = system.bodies, system.hinges
    bodies = x[: 6 * n].reshape(n, 6)
    wrenches = x[6 * n : 6 * (n + h)].reshape(h, 6)
    efforts = [power @ wrench for power, wrench in zip(powers, wrenches, strict=True)]
    return Accelerations(
        udot=x[6 * (n + h) : system.behind],
        center=bodies[:, :3],
        angular=bodies[:, 3:],
        force=wrenches[:, :3],
        moment=wrenches[:, 3:],
        effort=np.concatenate(efforts) if efforts else np.zeros(0),
    )


def _refined_solution(matrix: Array, right: Array) -> Array:
    """Solution of an equilibrated system, refined with residuals in extended precision."""
    scale_c = 1.0 / np.abs(matrix).max(axis=0)
    scale_r = 1.0 / np.abs(matrix * scale_c).max(axis=1)
    scaled = scale_r[:, None] * matrix * scale_c
    factors = scipy.linalg.lu_factor(scaled)
    wide_m, wide_r = scaled.astype(np.longdouble), (scale_r * right).astype(np.longdouble)
    x = scipy.linalg.lu_solve(factors, scale_r * right).astype(np.longdouble)
    for _ in range(2):
        x = x + scipy.linalg.lu_solve(factors, np.asarray(wide_r - wide_m @ x, float))
    return np.asarray(x * scale_c, float)


def mass_matrix(scene: Mapping[str, Any] | Tree, q: Array) -> Array:
    """Hessian of the kinetic energy in the speeds, reflected inertias included (nu, nu)."""
    tree = read(scene)
    out = np.diag(np.concatenate([np.zeros(0), *map(laws.reflected_inertia, tree.hinges)]))
    units = [motion(tree, np.asarray(q, float), column) for column in np.eye(tree.nu)]
    for i, body in enumerate(tree.bodies):
        v = np.array([at.velocity(i, body.center) for at in units]).reshape(tree.nu, 3)
        w = np.array([at.A[i].T @ at.w[i] for at in units]).reshape(tree.nu, 3)
        out += body.mass * v @ v.T + w @ body.inertia @ w.T
    return out


def energy(scene: Mapping[str, Any] | Tree, q: Array, u: Array) -> float:
    """Kinetic energy, gravity (zero at the origin) and springs; reflected inertias included."""
    tree = read(scene)
    at = motion(tree, np.asarray(q, float), np.asarray(u, float))
    total = 0.0
    for i, body in enumerate(tree.bodies):
        v, w = at.velocity(i, body.center), at.A[i].T @ at.w[i]
        total += 0.5 * body.mass * float(v @ v) + 0.5 * float(w @ body.inertia @ w)
        total -= body.mass * float(tree.gravity @ at.point(i, body.center))
    for hinge in tree.hinges:
        total += laws.hinge_potential(hinge, q)
        total += 0.5 * float((laws.reflected_inertia(hinge) * np.asarray(u)[hinge.u] ** 2).sum())
    return total + sum(laws.spring_potential(tree, at, s) for s in tree.springs)


def momentum(scene: Mapping[str, Any] | Tree, q: Array, u: Array) -> tuple[Array, Array]:
    """Linear momentum and angular momentum about the inertial origin."""
    tree = read(scene)
    at = motion(tree, np.asarray(q, float), np.asarray(u, float))
    linear, angular = np.zeros(3), np.zeros(3)
    for i, body in enumerate(tree.bodies):
        p = body.mass * at.velocity(i, body.center)
        linear += p
        angular += np.cross(at.point(i, body.center), p)
        angular += at.A[i] @ body.inertia @ at.A[i].T @ at.w[i]
    return linear, angular


def coordinate_rates(scene: Mapping[str, Any] | Tree, q: Array, u: Array) -> Array:
    """Time derivative of q."""
    tree = read(scene)
    out = np.zeros(tree.nq)
    for hinge in tree.hinges:
        own = u[hinge.u]
        out[hinge.q] = kinematics.coordinate_jet(hinge, q[hinge.q], own, np.zeros_like(own)).dx
    return out
