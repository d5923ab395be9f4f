"""Absolute coordinates with multipliers, integrated by SciPy: whole histories by another route.

State of every body: mass centre r, quaternion of the body axes, velocity v, angular velocity omega
(inertial axes).  Every hinge is the constraint its name says (coincident points, parallel and
perpendicular vectors), differentiated twice by Taylor arithmetic and stabilised (Baumgarte);
laws act through the speeds' own rows by virtual power.  Hinge coordinates are integrated beside
(angles unwrapped); displacements and quaternions are read from the poses.  The formulation is
that of E. J. Haug, Computer Aided Kinematics and Dynamics of Mechanical Systems, 1989.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.integrate
import scipy.linalg

from . import laws
from .algebra import attitude, pure, quaternion_product, to_quaternion
from .constraints import Absolute, Rows, constraint, refresh, rows_of, sides, speeds_of
from .expressions import drive
from .jets import Array, Jet
from .newton_euler import coordinate_rates, fill_driven, motion
from .tree import Hinge, Tree, read


@dataclass(frozen=True)
class History:
    """Times, hinge coordinates (time, nq) and speeds (time, nu), poses of the bodies' origins."""

    t: Array
    q: Array
    u: Array
    position: Array
    rotation: Array
    constraint: float


@dataclass(frozen=True)
class Solution:
    """Accelerations (bodies, 6), speeds' rates, coordinates, speeds, multipliers with their rows
    and hinges, law rows, poses."""

    accelerations: Array
    udot: Array
    q: Array
    u: Array
    multipliers: Array
    jacobian: Array
    owners: list[Hinge]
    moving: list[tuple[Hinge, Rows]]
    motion: laws.Motion


@dataclass(frozen=True)
class _Bound:
    """Acceleration constraints so far: row blocks, right-hand sides, owner of every row."""

    blocks: list[Array]
    targets: list[Array]
    owners: list[Hinge]

    def add(self, hinge: Hinge, rows: Array, target: Array) -> None:
        self.blocks.append(rows)
        self.targets.append(target)
        self.owners.extend([hinge] * len(rows))


class Equations:
    """Right-hand side of the absolute-coordinate equations of a tree."""

    def __init__(self, scene: Mapping[str, Any] | Tree, baumgarte: float = 5.0) -> None:
        self.tree = read(scene)
        self.baumgarte = baumgarte

    def start(self, q: Array, u: Array) -> Array:
        """State vector of hinge coordinates and speeds."""
        at = motion(self.tree, q, u)
        rows = []
        for i, body in enumerate(self.tree.bodies):
            turned = to_quaternion(at.A[i])
            point, speed = at.point(i, body.center), at.velocity(i, body.center)
            rows.append(np.concatenate([point, turned, speed, at.w[i]]))
        return np.concatenate([*rows, q])

    def _rows(self, state: Absolute) -> tuple[list[Any], list[Any], Array, Array]:
        """Constraint rows with their rates, law rows, hinge coordinates and speeds."""
        fixed, moving = [], []
        q, u = state.q.copy(), np.zeros(self.tree.nu)
        for hinge in self.tree.hinges:
            inner, outer = sides(self.tree, hinge, state)
            residual = constraint(hinge, inner, outer)
            if residual is not None:
                rate = rows_of(Jet(residual.dx), residual.ddx[0], hinge.parent)
                fixed.append((hinge, Rows(residual.x[0], rate.matrix, rate.bias), rate.value))
            speeds = speeds_of(hinge, inner, outer)
            if speeds is not None:
                moving.append((hinge, rows_of(speeds, speeds.dx[0], hinge.parent)))
                u[hinge.u] = speeds.x[0]
            refresh(hinge, inner, outer, q)
        return fixed, moving, q, u

    def solve(self, y: Array, t: float) -> Solution:
        """Accelerations of bodies and speeds, multipliers and what they belong to."""
        tree, state = self.tree, Absolute(self.tree, y)
        fixed, moving, q, u = self._rows(state)
        at, n = _motion(tree, state), len(tree.bodies)
        mass, force = _newton_euler(tree, at, laws.external_wrenches(tree, at, q, u, t))
        bound = _Bound([np.zeros((0, 6 * n))], [np.zeros(0)], [])
        for hinge, rows, rate in fixed:
            lag = -2 * self.baumgarte * rate - self.baumgarte**2 * rows.value
            bound.add(hinge, _spread_columns(hinge, rows.matrix, n), lag - rows.bias)
        for hinge, rows in moving:
            spread, free = _spread_columns(hinge, rows.matrix, n), _free_mask(hinge)
            rotor = np.where(free, laws.reflected_inertia(hinge), 0.0)
            effort = np.where(free, laws.hinge_effort(tree, hinge, q, u, t), 0.0)
            force += spread.T @ (effort - rotor * rows.bias)
            mass += spread.T @ (rotor[:, None] * spread)
            for i in np.flatnonzero(np.logical_not(free)).tolist():
                asked = self._drive_acceleration(hinge, i, q, rows.value[i], t)
                bound.add(hinge, spread[i : i + 1], np.array([asked - rows.bias[i]]))
        jacobian, m = np.vstack(bound.blocks), sum(len(b) for b in bound.blocks)
        system = np.block([[mass, jacobian.T], [jacobian, np.zeros((m, m))]])
        x = np.linalg.solve(system, np.concatenate([force, *bound.targets]))
        rates = x[: 6 * n]
        udot = np.zeros(tree.nu)
        for hinge, rows in moving:
            udot[hinge.u] = _spread_columns(hinge, rows.matrix, n) @ rates + rows.bias
        return Solution(
            rates.reshape(n, 6), udot, q, u, -x[6 * n :], jacobian, bound.owners, moving, at
        )

    def _drive_acceleration(self, hinge: Hinge, i: int, q: Array, speed: float, t: float) -> float:
        """Acceleration of a driven speed, with the same stabilisation as the constraints."""
        value, slope, second = drive(hinge.drive[i], t)
        lag = 2 * self.baumgarte * (speed - slope) + self.baumgarte**2 * (q[hinge.q][i] - value)
        return second - float(lag)

    def wrenches(self, y: Array, t: float) -> Array:
        """Load of the inboard on the outboard side at P (hinges, 6), inertial axes."""
        tree, found = self.tree, self.solve(y, t)
        q, u, at = found.q, found.u, found.motion
        out = np.zeros((len(tree.hinges), 6))
        for j, hinge in enumerate(tree.hinges):
            own = [i for i, owner in enumerate(found.owners) if owner is hinge]
            columns = slice(6 * hinge.child, 6 * hinge.child + 6)
            out[j] = found.jacobian[own, columns].T @ found.multipliers[own]
            for other, rows in found.moving:
                if other is hinge:
                    effort = laws.hinge_effort(tree, hinge, q, u, t)
                    effort = effort - laws.reflected_inertia(hinge) * found.udot[hinge.u]
                    out[j] += rows.matrix[:, 6:].T @ np.where(_free_mask(hinge), effort, 0.0)
            arm = at.point(hinge.child, hinge.rp)
            arm = arm - at.point(hinge.child, tree.bodies[hinge.child].center)
            out[j, 3:] -= np.cross(arm, out[j, :3])
        return out

    def __call__(self, t: float, y: Array) -> Array:
        """Time derivative of the state vector."""
        tree, state = self.tree, Absolute(self.tree, y)
        found = self.solve(y, t)
        rows = []
        for i, acceleration in enumerate(found.accelerations):
            turning = quaternion_product(pure(state.w[i]), state.e[i]) / 2
            rows.append(np.concatenate([state.v[i], turning, acceleration]))
        return np.concatenate([*rows, coordinate_rates(tree, found.q, found.u)])


def _motion(tree: Tree, state: Absolute) -> laws.Motion:
    at = laws.Motion(tree)
    for i, body in enumerate(tree.bodies):
        at.A[i] = attitude(state.e[i])
        arm = -at.A[i] @ body.center
        at.w[i] = state.w[i]
        at.r[i], at.v[i] = state.r[i] + arm, state.v[i] + np.cross(state.w[i], arm)
    return at


def _free_mask(hinge: Hinge) -> Array:
    return np.array([text == "free" for text in hinge.drive])


def _newton_euler(tree: Tree, at: laws.Motion, external: Array) -> tuple[Array, Array]:
    """Mass matrix of the free bodies and loads less gyroscopic moments, flattened."""
    blocks, force = [], external.copy()
    for i, body in enumerate(tree.bodies):
        inertia = at.A[i] @ body.inertia @ at.A[i].T
        blocks += [body.mass * np.eye(3), inertia]
        force[i, 3:] -= np.cross(at.w[i], inertia @ at.w[i])
    return scipy.linalg.block_diag(*blocks), force.ravel()


def _spread_columns(hinge: Hinge, matrix: Array, n: int) -> Array:
    out = np.zeros((len(matrix), 6 * n))
    if hinge.parent >= 0:
        out[:, 6 * hinge.parent : 6 * hinge.parent + 6] = matrix[:, :6]
    out[:, 6 * hinge.child : 6 * hinge.child + 6] = matrix[:, 6:]
    return out


def simulate(
    scene: Mapping[str, Any] | Tree,
    times: Array,
    q: Array | None = None,
    u: Array | None = None,
    rtol: float = 1e-11,
    atol: float = 1e-12,
    method: str = "DOP853",
) -> History:
    """History of hinge coordinates and speeds at `times`, from the scene's start values or q, u."""
    tree = read(scene)
    start_q, start_u = tree.initial()
    q = start_q if q is None else np.array(q, float)
    u = start_u if u is None else np.array(u, float)
    fill_driven(tree, q, u, float(times[0]))
    equations = Equations(tree)
    span = (float(times[0]), float(times[-1]))
    found = scipy.integrate.solve_ivp(
        equations, span, equations.start(q, u), method, times, rtol=rtol, atol=atol
    )
    if not found.success:
        raise RuntimeError(found.message)
    states = [Absolute(tree, y) for y in found.y.T]
    parts = [equations._rows(s) for s in states]
    poses = [_motion(tree, s) for s in states]
    worst = max((float(np.abs(r.value).max()) for p in parts for _, r, _ in p[0]), default=0.0)
    return History(
        t=found.t,
        q=np.array([p[2] for p in parts]),
        u=np.array([p[3] for p in parts]),
        position=np.array([at.r[:-1] for at in poses]),
        rotation=np.array([at.A[:-1] for at in poses]),
        constraint=worst,
    )
