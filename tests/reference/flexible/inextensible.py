"""Planar chains of inextensible beams in absolute angles, without any floating frame.

A point of the chain is the integral of (cos theta, sin theta) along it, and all angles are linear
in the coordinates: theta = B a + offset + theta_0(t).  The energies are those of motion,
gravity and strain:

    T = 1/2 sum_ij K_ij cos(theta_i - theta_j) theta_i' theta_j',   V_g = g sum_i m_i sin theta_i,
    V_s = 1/2 a^T S a,

and Lagrange's equations follow in two lines.  Two discretisations share this form and nothing else:
`segments` (rigid rods of equal length, torsion springs between them, error of order 1/N^2) and
`spectral` (angles as polynomials, Gauss quadrature, error that falls exponentially).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import scipy.integrate
import scipy.linalg
from numpy.polynomial import legendre

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Beam:
    """A uniform beam; `joint` to what lies inboard: "pin", or "weld" at `angle` to its end."""

    length: float
    bending_stiffness: float
    mass_per_length: float = 1.0
    joint: str = "pin"
    angle: float = 0.0
    tip_mass: float = 0.0


@dataclass(frozen=True)
class Chain:
    """`K`, `B`, `S` as in the module's text; `first` (nodes,) moments of mass for gravity;
    `tip` (nodes,) integrates the direction to the tip; `start` absolute angles at rest less B a."""

    K: Array
    B: Array
    S: Array
    first: Array
    tip: Array
    offset: Array
    gravity: float = 0.0
    base: Callable[[float], tuple[float, float, float]] | None = None
    #: Acceleration of the root over time.
    lift: Callable[[float], tuple[float, float]] | None = None
    #: Particles (spectral form): their masses, and the paths from the root to them.
    mass: Array | None = None
    path: Array | None = None

    def angles(self, t: float, a: Array, rate: Array) -> tuple[Array, Array, float]:
        """Absolute angles, their rates and the base's angular acceleration."""
        theta_0, omega, alpha = self.base(t) if self.base else (0.0, 0.0, 0.0)
        return self.B @ a + self.offset + theta_0, self.B @ rate + omega, alpha

    def acceleration(self, t: float, a: Array, rate: Array) -> Array:
        """Second derivative of the coordinates."""
        theta, omega, alpha = self.angles(t, a, rate)
        c, s = np.cos(theta), np.sin(theta)
        inertia = self.K * (np.outer(c, c) + np.outer(s, s))
        turning = self.K * (np.outer(s, c) - np.outer(c, s))
        ax, ay = self.lift(t) if self.lift else (0.0, 0.0)
        weight = self.first * ((self.gravity + ay) * c - ax * s)
        load = turning @ omega**2 + inertia.sum(1) * alpha + weight
        mass = self.B.T @ inertia @ self.B
        return -np.asarray(
            scipy.linalg.solve(mass, self.B.T @ load + self.S @ a, assume_a="pos"), float
        )

    def position(self, t: float, a: Array) -> Array:
        """Tip (2,) in inertial axes, root at the origin."""
        theta, _, _ = self.angles(t, a, np.zeros_like(a))
        return np.array([self.tip @ np.cos(theta), self.tip @ np.sin(theta)])

    def energy(self, t: float, a: Array, rate: Array) -> float:
        """Kinetic, gravity and strain energy."""
        theta, omega, _ = self.angles(t, a, rate)
        c, s = np.cos(theta), np.sin(theta)
        kinetic = (c * omega) @ self.K @ (c * omega) + (s * omega) @ self.K @ (s * omega)
        return float(0.5 * kinetic + self.gravity * self.first @ s + 0.5 * a @ self.S @ a)

    def run(
        self, times: Sequence[float] | Array, rtol: float = 1e-9, start: Array | None = None
    ) -> tuple[Array, Array]:
        """Coordinates and rates (times, n) from rest at `start`."""
        n = self.B.shape[1]

        def rate(t: float, y: Array) -> Array:
            return np.concatenate([y[n:], self.acceleration(t, y[:n], y[n:])])

        begin = np.concatenate([np.zeros(n) if start is None else start, np.zeros(n)])
        run = scipy.integrate.solve_ivp(
            rate, (times[0], times[-1]), begin, "DOP853", times, rtol=rtol, atol=rtol * 1e-3
        )
        assert run.success, run.message
        return run.y[:n].T, run.y[n:].T

    def tips(self, times: Sequence[float] | Array, rtol: float = 1e-9) -> Array:
        """Tip over time (times, 2) from undeformed rest."""
        a, _ = self.run(times, rtol)
        return np.array([self.position(t, row) for t, row in zip(times, a, strict=True)])

    def particles(self, t: float, a: Array, rate: Array) -> tuple[Array, Array, Array]:
        """Masses (m,), places and velocities (m, 2) of the particles against the root."""
        assert self.mass is not None
        assert self.path is not None
        theta, omega, _ = self.angles(t, a, rate)
        c, s = np.cos(theta), np.sin(theta)
        place = self.path @ np.array([c, s]).T
        return self.mass, place, self.path @ (np.array([-s, c]) * omega).T

    def with_driven_base(self, base: Callable[[float], tuple[float, float, float]]) -> Chain:
        """The chain on a base that turns as t -> (angle, rate, acceleration)."""
        return replace(self, base=base)


def spectral(
    beams: Sequence[Beam], order: int, gravity: float = 0.0, clamped: bool = False
) -> Chain:
    """Angles of every beam as polynomials of degree `order`; root clamped to the base or pinned."""
    nodes = order + 12
    x, w = legendre.leggauss(nodes)
    xi, w = (x + 1) / 2, w / 2
    # Integrals of the Lagrange interpolants from 0 to the nodes, by way of Legendre coefficients.
    to_series = np.linalg.inv(legendre.legvander(x, nodes - 1))
    powers = [legendre.legint(np.eye(nodes)[k], lbnd=-1) for k in range(nodes)]
    inner = np.array([legendre.legval(x, p) for p in powers]).T @ to_series / 2
    shapes = np.array([_legendre_integral(k, xi) for k in range(order + 1)]).T
    ends = np.array([_legendre_integral(k, np.array([1.0]))[0] for k in range(order + 1)])
    curvature = np.array([_curvature(k, xi) for k in range(order + 1)]).T
    count = len(beams) * nodes
    columns = 0
    B, offset = np.zeros((count, 0)), np.zeros(count)
    S = np.zeros((0, 0))
    end_row, end_angle = np.zeros(0), 0.0
    for b, beam in enumerate(beams):
        rows = slice(b * nodes, (b + 1) * nodes)
        welded = clamped if b == 0 else beam.joint == "weld"
        first = 1 if welded else 0
        new = order + 1 - first
        B = np.hstack([B, np.zeros((count, new))])
        end_row = np.concatenate([end_row, np.zeros(new)])
        row = end_row.copy() if welded else np.zeros(columns + new)
        B[rows] = row
        B[rows, columns:] += shapes[:, first:]
        offset[rows] = beam.angle + (end_angle if welded else 0.0)
        end_angle = beam.angle + (end_angle if welded else 0.0)
        end_row = row.copy()
        end_row[columns:] += ends[first:]
        bent = curvature[:, first:]
        own = beam.bending_stiffness / beam.length * (bent.T * w) @ bent
        S = scipy.linalg.block_diag(S, own)
        columns += new
    mass, path = _path(beams, inner, w)
    reach = np.concatenate([beam.length * w for beam in beams])
    K, first_moment = path.T @ (mass[:, None] * path), path.T @ mass
    for b, beam in enumerate(beams):
        till = reach * (np.arange(count) < (b + 1) * nodes)
        K = K + beam.tip_mass * np.outer(till, till)
        first_moment = first_moment + beam.tip_mass * till
    return Chain(K, B, S, first_moment, reach, offset, gravity, mass=mass, path=path)


def _legendre_integral(k: int, xi: Array) -> Array:
    """1 for k = 0, else the integral from 0 of the Legendre polynomial of degree k - 1."""
    if k == 0:
        return np.ones_like(xi)
    series = legendre.legint(np.eye(k)[k - 1], lbnd=-1) / 2
    return np.asarray(legendre.legval(2 * xi - 1, series), float)


def _curvature(k: int, xi: Array) -> Array:
    if k == 0:
        return np.zeros_like(xi)
    return np.asarray(legendre.legval(2 * xi - 1, np.eye(k)[k - 1]), float)


def _path(beams: Sequence[Beam], inner: Array, w: Array) -> tuple[Array, Array]:
    """Mass at every node and the matrix that integrates the direction from the root to it."""
    nodes = len(w)
    path = np.zeros((len(beams) * nodes,) * 2)
    for b, beam in enumerate(beams):
        rows = slice(b * nodes, (b + 1) * nodes)
        path[rows, rows] = beam.length * inner
        for inboard in range(b):
            path[rows, inboard * nodes : (inboard + 1) * nodes] = beams[inboard].length * w
    mass = np.concatenate([beam.mass_per_length * beam.length * w for beam in beams])
    return mass, path


def segments(
    beams: Sequence[Beam], each: int, gravity: float = 0.0, clamped: bool = False
) -> Chain:
    """`each` rigid rods per beam with torsion springs between their ends."""
    count = len(beams) * each
    lengths = np.repeat([beam.length / each for beam in beams], each)
    masses = np.repeat([beam.mass_per_length * beam.length / each for beam in beams], each)
    bending = np.repeat([beam.bending_stiffness for beam in beams], each)
    K, first = np.zeros((count, count)), np.zeros(count)
    for i in range(count):
        # Centre of rod i: the rods before it in full, half of its own; its own inertia besides.
        reach = np.where(np.arange(count) < i, lengths, 0.0)
        reach[i] = lengths[i] / 2
        K += masses[i] * np.outer(reach, reach)
        K[i, i] += masses[i] * lengths[i] ** 2 / 12
        first += masses[i] * reach
    for b, beam in enumerate(beams):
        till = np.where(np.arange(count) < (b + 1) * each, lengths, 0.0)
        K += beam.tip_mass * np.outer(till, till)
        first += beam.tip_mass * till
    S, offset = np.zeros((count, count)), np.zeros(count)
    angle = 0.0
    for i in range(count):
        beam, at_joint = beams[i // each], i % each == 0
        fixed = clamped if i == 0 else beam.joint == "weld"
        if at_joint:
            angle = beam.angle + (angle if fixed and i else 0.0)
        offset[i] = angle
        if at_joint and not fixed:
            continue
        # Half a rod bends on either side of a joint, none on the side of the base.
        compliance = lengths[i] / (2 * bending[i])
        row = np.zeros(count)
        row[i] = 1.0
        if i:
            compliance += lengths[i - 1] / (2 * bending[i - 1])
            row[i - 1] = -1.0
        S += np.outer(row, row) / compliance
    return Chain(K, np.eye(count), S, first, lengths, offset, gravity)


def extrapolated_limit(values: Sequence[Array]) -> tuple[Array, float]:
    """Limit of values at N, 2 N, ... with errors in even powers of 1/N, and its last correction."""
    table = [np.asarray(v, float) for v in values]
    power = 4.0
    last = table[-1]
    while len(table) > 1:
        table = [(power * b - a) / (power - 1) for a, b in pairwise(table)]
        last, previous = table[-1], last
        power *= 4
    return last, float(np.abs(last - previous).max())


def spin_up(speed: float, duration: float = 15.0) -> Callable[[float], tuple[float, float, float]]:
    """Angle, rate and acceleration of omega = speed (t/T - sin(2 pi t/T)/(2 pi)), then constant."""

    def base(t: float) -> tuple[float, float, float]:
        w = 2 * np.pi / duration
        if t >= duration:
            return speed * (t - duration / 2), speed, 0.0
        angle = speed / duration * (t * t / 2 + (np.cos(w * t) - 1) / w**2)
        rate = speed / duration * (t - np.sin(w * t) / w)
        return angle, rate, speed / duration * (1 - np.cos(w * t))

    return base
