"""Motions known in closed form, and published numbers, each with its source."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.special import ellipj, ellipk

from .algebra import turn, unit
from .jets import Array, as_jet

#: Point mass 1 kg on a massless rod of 1 m, released at rest at (-1, 0), g = 9.81 m/s2: t, x, y.
#: Benchmark A01 of the IFToMM library of computational benchmark problems (M. Gonzalez, D.
#: Dopico, U. Lugris, J. Cuadrado, Multibody System Dynamics 16, 2006); values by integration to
#: 25 digits, which the elliptic functions below reproduce.
A01_POSITIONS = (
    (1.0, 0.986291751131875, -0.165010853125541),
    (5.0, -0.942305435043757, -0.334754338414001),
    (10.0, -0.275087462576117, -0.961419205099125),
)
A01_PERIOD = 2.36784194757624


def pendulum_period(length: float, gravity: float, amplitude: float) -> float:
    """Period of a point pendulum, 4 sqrt(L/g) K(sin^2(amplitude/2)).

    L. D. Landau, E. M. Lifshitz, Mechanics, 3rd ed. 1976, section 11, problem 1.
    """
    return float(4 * np.sqrt(length / gravity) * ellipk(np.sin(amplitude / 2) ** 2))


def pendulum_angle(t: Array, length: float, gravity: float, start: float) -> Array:
    """Angle from the downward vertical of a point pendulum released at rest at `start` (rad).

    sin(angle/2) = k cd(sqrt(g/L) t, k), k = sin(start/2); E. T. Whittaker, Analytical Dynamics,
    4th ed. 1937, section 44.
    """
    k = np.sin(start / 2)
    _, cn, dn, _ = ellipj(np.sqrt(gravity / length) * np.asarray(t), k**2)
    return np.asarray(2 * np.arcsin(k * cn / dn))


def damped_oscillator(t: Array, mass: float, stiffness: float, damping: float, x0: float) -> Array:
    """Displacement of an underdamped mass on a spring released at rest at x0.

    Landau, Lifshitz, Mechanics, section 25.
    """
    decay = damping / (2 * mass)
    rate = np.sqrt(stiffness / mass - decay**2)
    swing = np.cos(rate * np.asarray(t)) + decay / rate * np.sin(rate * np.asarray(t))
    return np.asarray(x0 * np.exp(-decay * np.asarray(t)) * swing)


def screw_fall(mass: float, inertia: float, lead: float, gravity: float) -> float:
    """Angular acceleration of a body sliding down a smooth vertical screw (energy balance)."""
    pitch = lead / (2 * np.pi)
    return -mass * gravity * pitch / (inertia + mass * pitch**2)


def free_top_attitude(
    t: float, transverse: float, axial: float, start: Array, omega: Array
) -> Array:
    """Attitude of a force-free symmetric body (axis z, inertia A, A, C) after time t.

    `start` takes body to inertial axes, `omega` is in body axes.  The body turns about its axis at
    lambda = (1 - C/A) omega_3 while this axis turns about the angular momentum L at |L|/A.
    Landau, Lifshitz, Mechanics, section 33; H. Goldstein, Classical Mechanics, section 5.6.
    """
    momentum = start @ (np.array([transverse, transverse, axial]) * omega)
    size = float(np.linalg.norm(momentum))
    precession = turn(unit(momentum), as_jet(size / transverse * t)).x
    spin = turn(np.eye(3)[2], as_jet((1 - axial / transverse) * omega[2] * t)).x
    return np.asarray(precession @ start @ spin)


def free_top_rates(t: Array, transverse: float, axial: float, omega: Array) -> Array:
    """Body-fixed angular velocity of the same body, (time, 3)."""
    phase = (1 - axial / transverse) * omega[2] * np.asarray(t)
    c, s = np.cos(phase), np.sin(phase)
    rest = np.full_like(phase, omega[2])
    return np.stack([c * omega[0] + s * omega[1], c * omega[1] - s * omega[0], rest], axis=-1)


@dataclass(frozen=True)
class HeavyTop:
    """Symmetric top with a fixed point, weight M g at distance l along its axis.

    `transverse` (about the fixed point) and `axial` inertia, `weight_moment` = M g l, nutation
    angle `theta` from the upward vertical at an extremum (rate zero), precession rate `phi_rate`
    and axial angular velocity `spin` = omega_3 at the start.
    H. Goldstein, Classical Mechanics, section 5.7: with u = cos(theta),
    u'^2 = (1 - u^2)(alpha - beta u) - (b - a u)^2, phi' = (b - a u)/(1 - u^2).
    """

    transverse: float
    axial: float
    weight_moment: float
    theta: float
    phi_rate: float
    spin: float

    @property
    def _constants(self) -> tuple[float, float, float, float]:
        a = self.axial * self.spin / self.transverse
        u = np.cos(self.theta)
        b = self.phi_rate * np.sin(self.theta) ** 2 + a * u
        beta = 2 * self.weight_moment / self.transverse
        alpha = (self.phi_rate * np.sin(self.theta)) ** 2 + beta * u
        return a, b, alpha, beta

    def cosine(self, t: Array) -> Array:
        """cos(theta) at the times t, by Jacobi's elliptic functions."""
        a, b, alpha, beta = self._constants
        start = float(np.cos(self.theta))
        # The start is a root; the other two follow from the remaining quadratic in u.
        cubic = np.poly1d([beta, -(alpha + a**2), 2 * a * b - beta, alpha - b**2])
        quotient, _ = np.polydiv(cubic, np.poly1d([1.0, -start]))
        low, middle, high = sorted([start, *np.real(np.roots(quotient))])
        rate = np.sqrt(beta * (high - low)) / 2
        parameter = (middle - low) / (high - low)
        sn, cn, dn, _ = ellipj(rate * np.asarray(t), parameter)
        wave = sn if abs(start - low) < abs(start - middle) else cn / dn
        return np.asarray(low + (middle - low) * wave**2)

    def attitude(self, t: float) -> Array:
        """Rz(phi) Rx(theta) Rz(psi) at time t, phi = psi = 0 at the start."""
        a, b, _, _ = self._constants

        def rate(s: float) -> float:
            u = float(self.cosine(np.array(s)))
            return (b - a * u) / (1 - u**2)

        def spin_rate(s: float) -> float:
            return self.spin - float(self.cosine(np.array(s))) * rate(s)

        phi = quad(rate, 0, t, epsabs=1e-13, epsrel=1e-13, limit=400)[0]
        psi = quad(spin_rate, 0, t, epsabs=1e-13, epsrel=1e-13, limit=400)[0]
        theta = float(np.arccos(self.cosine(np.array(t))))
        x, _, z = np.eye(3)
        turns = [turn(axis, as_jet(angle)).x for axis, angle in ((z, phi), (x, theta), (z, psi))]
        return np.asarray(turns[0] @ turns[1] @ turns[2])


def steady_precession(
    transverse: float, axial: float, weight_moment: float, theta: float, spin: float
) -> tuple[float, float]:
    """Slow and fast precession rate of a heavy top at constant nutation angle.

    A cos(theta) phi'^2 - C omega_3 phi' + M g l = 0; Goldstein, Classical Mechanics, (5.77).
    """
    roots = np.roots([transverse * np.cos(theta), -axial * spin, weight_moment])
    if np.iscomplexobj(roots):
        raise ValueError("the top spins too slowly for a steady precession at this angle")
    slow, fast = sorted(roots, key=abs)
    return float(slow), float(fast)


def pendulum_scene(length: float = 1.0, gravity: float = 9.81) -> dict[str, Any]:
    """Point pendulum in the x-y plane, angle from +x; A01 starts at angle pi."""
    return {
        "schema_version": 1,
        "gravity": [0.0, -gravity, 0.0],
        "body": [
            {"name": "bob", "mass": 1.0, "center_of_mass": [length, 0, 0], "inertia": [0] * 3}
        ],
        "hinge": [
            {
                "name": "pivot",
                "type": "pin",
                "inboard": "ground",
                "outboard": "bob",
                "initial": {"q": [np.pi], "u": [0.0]},
            }
        ],
    }


def top_scene(
    mass: float, arm: float, transverse: float, axial: float, gravity: float = 9.81
) -> dict[str, Any]:
    """Symmetric body on a ball hinge at the origin, its mass centre at `arm` along its z axis;
    inertias about the mass centre."""
    return {
        "schema_version": 1,
        "gravity": [0.0, 0.0, -gravity],
        "body": [
            {
                "name": "top",
                "mass": mass,
                "center_of_mass": [0, 0, arm],
                "inertia": [transverse, transverse, axial],
            }
        ],
        "hinge": [{"name": "foot", "type": "ball", "inboard": "ground", "outboard": "top"}],
    }
