"""The exact static rod of Kirchhoff: inextensible, unshearable, straight at rest, clamped at s = 0.

With r(s) the axis, R(s) the attitude (its columns are the tangent t and the section's y and z), n
and m the force and moment that the outer part puts on the inner one, all in axes of the root,

    r' = t,   R' = [u]x R,   n' = -q,   m' = -t x n,   u = C m,
    C = R diag(1/GJ, 1/EI_y, 1/EI_z) R^T,

and an infinitesimal motion about it (d theta the rotation, harmonic in time with the square w2
of its frequency; rod's mass per length mu, J = R diag(j, i_y, i_z) R^T) obeys

    dr' = dth x t,   dth' = C (dm - dth x m),
    dn' = -w2 mu dr,  dm' = -(dth x t) x n - t x dn - w2 J dth.

Both are integrated together from the root; Newton's method finds n and m there.  Its matrix is
exact, and where it is singular for w2 = 0 the rod is at a bifurcation, else in free vibration.
(Antman, Nonlinear Problems of Elasticity, chapter 8; Love, Mathematical Theory of Elasticity, 18.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy.integrate
import scipy.optimize
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
ZERO: Vector = (0.0, 0.0, 0.0)

#: Places in the state: axis, attitude (rows of R), force, moment, integrals of twist and of energy.
R_, A_, N_, M_, TWIST, ENERGY = slice(0, 3), slice(3, 12), slice(12, 15), slice(15, 18), 18, 19
STATE = 20
#: Of the motion's twelve rows: displacement and rotation, force and moment.
MOVED, LOADED = slice(0, 6), slice(6, 12)
#: Force along z, moments about x and y: what a motion out of the plane x-y puts on a section.
LATERAL = np.array([2, 3, 4])
EYE = np.eye(3)


@dataclass(frozen=True)
class Rod:
    """`bending` EI_y (deflection along z) and EI_z (along y), N m^2; `torsion` GJ, N m^2; per
    length: mass, kg/m, polar and `rotary` inertia (about y and z), kg m."""

    bending: tuple[float, float]
    torsion: float
    length: float = 1.0
    mass: float = 1.0
    polar: float = 0.0
    rotary: tuple[float, float] = (0.0, 0.0)

    @property
    def compliance(self) -> Array:
        """Of the section, about x, y, z."""
        return 1 / np.array([self.torsion, *self.bending])


@dataclass(frozen=True)
class Load:
    """At the tip `force`, N, on a rigid `arm`, m, in section axes, and `moment`, N m; `per_length`
    a dead load along the axis, N/m.  Force and moment keep their direction in space, or turn with
    the tip's section where `follower`."""

    force: Vector = ZERO
    moment: Vector = ZERO
    per_length: Vector = ZERO
    arm: Vector = ZERO
    follower: bool = False

    def __mul__(self, factor: float) -> Load:
        def scaled_vector(v: Vector) -> Vector:
            return (factor * v[0], factor * v[1], factor * v[2])

        force, moment, spread = map(scaled_vector, (self.force, self.moment, self.per_length))
        return replace(self, force=force, moment=moment, per_length=spread)

    def tip_load(self, attitude: Array) -> tuple[Array, Array]:
        """Force and moment on the tip's section (3,), in axes of the root."""
        force, moment = np.array(self.force), np.array(self.moment)
        if self.follower:
            force, moment = attitude @ force, attitude @ moment
        return force, moment + np.cross(attitude @ np.array(self.arm), force)

    def rotation_derivative(self, attitude: Array) -> Array:
        """Derivative (6, 3) of force and moment by the section's rotation."""
        force, moment = self.tip_load(attitude)
        if self.follower:
            return -np.vstack([cross(force), cross(moment)])
        return np.vstack([np.zeros((3, 3)), cross(force) @ cross(attitude @ np.array(self.arm))])


@dataclass(frozen=True)
class State:
    """A rod in equilibrium; `root` (6,) force and moment there."""

    rod: Rod
    load: Load
    root: Array

    @cached_property
    def end(self) -> Array:
        """State (20,) at the tip."""
        return march(self.rod, self.load, self.root)[0]

    @property
    def tip(self) -> Array:
        """Displacement (3,), m."""
        return self.end[R_] - np.array([self.rod.length, 0.0, 0.0])

    @property
    def attitude(self) -> Array:
        """Of the tip's section (3, 3): columns are its axes."""
        return self.end[A_].reshape(3, 3)

    @property
    def rotation(self) -> Array:
        """Of the tip, as rotation vector (3,), rad."""
        return np.asarray(Rotation.from_matrix(self.attitude).as_rotvec(), float)

    @property
    def twist(self) -> float:
        """Integral of the section's rate of turning about the tangent, rad."""
        return float(self.end[TWIST])

    @property
    def energy(self) -> float:
        """Of strain, J."""
        return float(self.end[ENERGY])

    def states_at(self, places: Array) -> Array:
        """States (places, 20)."""
        return march(self.rod, self.load, self.root, places=places)[2][:, :STATE]

    def end_matrix(self, square: float = 0.0) -> Array:
        """What is missing at the tip (6, 6), by force and moment at the root."""
        return _miss(self.rod, self.load, self.root, square)[1]

    def compliance(self) -> Array:
        """Displacement and rotation of the tip (6, 6) by further dead force and moment there."""
        motion = march(self.rod, self.load, self.root)[1]
        return np.asarray(motion[MOVED] @ np.linalg.inv(self.end_matrix()), float)

    def buckled_directions(self, count: int = 200) -> int:
        """Number of independent motions in which the potential energy falls, under dead loads.

        Conjugate points: zeros within the rod of the determinant of rotations of motions that
        leave the tip without load (the index of the second variation, free at the tip).
        """
        places = np.linspace(0.0, self.rod.length, count + 1)
        _, motion, rows = march(self.rod, self.load, self.root, places=places, full=True)
        ends = np.hstack(
            [np.zeros((6, 3)), -self.load.rotation_derivative(self.attitude), np.eye(6)]
        )
        free = np.linalg.svd(ends @ motion)[2][6:].T
        turned = rows[:, STATE:].reshape(-1, 12, 12)[:, 3:6] @ free
        # Of the six free motions three are translations, which turn nothing.
        keep = np.linalg.svd(turned[-1])[2][:3].T
        signs = np.sign(np.linalg.det(turned @ keep))
        return int((signs[1:] != signs[:-1]).sum())

    def frequencies(
        self, low: float, high: float, step: float, lateral: bool = False
    ) -> list[float]:
        """Natural frequencies, rad/s, from `low` to `high`; a growth rate, 1/s, counts as negative.

        Roots of the determinant between samples `step` apart: pairs closer than that are missed.
        With `lateral` only motions out of the plane x-y, about a state within it.
        """
        rows = LATERAL if lateral else np.arange(6)

        def determinant(w: float) -> float:
            return float(np.linalg.det(self.end_matrix(w * abs(w))[np.ix_(rows, rows)]))

        samples = np.arange(low, high + step, step)
        values = [determinant(w) for w in samples]
        return [
            float(scipy.optimize.brentq(determinant, samples[i], samples[i + 1], xtol=1e-11))
            for i in range(len(samples) - 1)
            if values[i] * values[i + 1] < 0
        ]


def cross(v: Array) -> Array:
    """The matrix of v x."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def _slope(rod: Rod, load: Load, square: float) -> Callable[[float, Array], Array]:
    """Derivative along the axis of the state and of the columns of motions that follow it."""
    section, spread = rod.compliance, np.array(load.per_length)
    carried, inertia = square * rod.mass, square * np.array([rod.polar, *rod.rotary])

    def slope(_: float, y: Array) -> Array:
        R, n, m = y[A_].reshape(3, 3), y[N_], y[M_]
        t, own = R[:, 0], section * (m @ R)
        u = R @ own
        out = np.empty_like(y)
        out[R_], out[N_] = t, -spread
        out[A_] = (cross(u) @ R).ravel()
        out[M_] = -cross(t) @ n
        out[TWIST], out[ENERGY] = own[0], 0.5 * own @ (m @ R)
        C, tx = (R * section) @ R.T, cross(t)
        d = y[STATE:].reshape(12, -1)
        dr, turned, dn, dm = d[0:3], d[3:6], d[6:9], d[9:12]
        rates = out[STATE:].reshape(12, -1)
        rates[0:3], rates[6:9] = -tx @ turned, -carried * dr
        rates[3:6] = C @ (dm + cross(m) @ turned)
        rates[9:12] = -(cross(n) @ tx + (R * inertia) @ R.T) @ turned - tx @ dn
        return out

    return slope


def march(
    rod: Rod,
    load: Load,
    root: Array,
    square: float = 0.0,
    places: Array | None = None,
    full: bool = False,
) -> tuple[Array, Array, Array]:
    """State at the tip (20,), motions there (12, 6) for unit forces and moments at the root
    (12, 12 with displacements and rotations before them where `full`), and all at the places."""
    motions = np.eye(12) if full else np.eye(12)[:, LOADED]
    begin = np.concatenate([np.zeros(3), EYE.ravel(), root, [0.0, 0.0], motions.ravel()])
    run = scipy.integrate.solve_ivp(
        _slope(rod, load, square),
        (0.0, rod.length),
        begin,
        "DOP853",
        t_eval=places,
        rtol=1e-12,
        atol=1e-13,
    )
    assert run.success, run.message
    last = run.y[:, -1]
    return last[:STATE], last[STATE:].reshape(12, -1), run.y.T


def _miss(rod: Rod, load: Load, root: Array, square: float = 0.0) -> tuple[Array, Array]:
    """Force and moment at the tip less the load's (6,), and their derivatives (6, 6)."""
    end, motion, _ = march(rod, load, root, square)
    attitude = end[A_].reshape(3, 3)
    miss = np.concatenate([end[N_], end[M_]]) - np.concatenate(load.tip_load(attitude))
    return miss, motion[LOADED] - load.rotation_derivative(attitude) @ motion[3:6]


def _newton(rod: Rod, load: Load, root: Array) -> Array | None:
    """Force and moment at the root, or None where ten steps do not settle."""
    scale = 1.0 + float(np.abs(root).max())
    for _ in range(10):
        miss, matrix = _miss(rod, load, root)
        step = np.linalg.solve(matrix, miss)
        size = float(np.abs(step).max())
        if not size < 10 * scale:
            return None
        root = root - step
        if size < 1e-12 * scale:
            return root
    return root if size < 1e-10 * scale else None


def solve(rod: Rod, load: Load, start: State | None = None) -> State:
    """Equilibrium under `load`, along a straight path of loads from that of `start` (or none).

    Two states on one branch may be joined by way of other loads: `solve` one after the other.
    """
    origin = start.load if start else replace(load, force=ZERO, moment=ZERO, per_length=ZERO)
    root = start.root if start else np.zeros(6)
    done, stride, before = 0.0, 1.0, None
    while done < 1.0:
        part = min(done + stride, 1.0)
        guess = root if before is None else root + (part - done) * before
        found = _newton(rod, _between(origin, load, part), guess)
        if found is None:
            stride /= 2
            assert stride > 1e-4, "no equilibrium found"
            continue
        before, root, done = (found - root) / (part - done), found, part
    return State(rod, load, root)


def _between(a: Load, b: Load, part: float) -> Load:
    def interpolated_vector(x: Vector, y: Vector) -> Vector:
        one, two, three = (1 - part) * np.array(x) + part * np.array(y)
        return (one, two, three)

    return replace(
        b,
        force=interpolated_vector(a.force, b.force),
        moment=interpolated_vector(a.moment, b.moment),
        per_length=interpolated_vector(a.per_length, b.per_length),
    )


def lateral_bifurcation(rod: Rod, load: Load, low: float, high: float) -> float:
    """Factor of a load within the plane x-y between `low` and `high` at which the bent rod first
    turns out of that plane."""

    def determinant(factor: float) -> float:
        matrix = solve(rod, load * factor).end_matrix()
        return float(np.linalg.det(matrix[np.ix_(LATERAL, LATERAL)]))

    return float(scipy.optimize.brentq(determinant, low, high, xtol=1e-12, rtol=1e-12))


def rectangle(ratio: float, poisson: float) -> float:
    """GJ/EI of the weak axis, for a rectangle of sides ratio : 1 (Saint-Venant's series)."""
    odd = np.arange(1.0, 40.0, 2.0)
    factor = 1 / 3 - 64 / (np.pi**5 * ratio) * (np.tanh(odd * np.pi * ratio / 2) / odd**5).sum()
    return float(factor * 12 / (2 * (1 + poisson)))
