"""Heavy symmetric top against its closed solution.

Statements: (1) the height of the axis, cos(theta), follows the elliptic function of the cubic
that energy and the two angular momenta fix, between its two roots (nutation), and the precession
angle follows its integral; (2) started with either root of the steady-precession equation the
lean stays constant, the axis turns uniformly and the point carries weight and centripetal force.
Closed forms: L. D. Landau, E. M. Lifshitz, Mechanics, section 35; H. Goldstein, Classical
Mechanics, section 5-7.
"""

from __future__ import annotations

import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.special import ellipj, ellipkinc

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
TIMES = np.linspace(0.0, 2.0, 201)
Array = NDArray[np.float64]


def axis(quaternion: Array) -> Array:
    """Inertial direction of the body's z axis (time, 3) from w, x, y, z."""
    w, x, y, z = quaternion.T
    return np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), w * w + z * z - x * x - y * y], 1)


class Top:
    """Constants of the top and the motion of its axis."""

    def __init__(self, data: dict[str, Any]) -> None:
        body, initial = data["body"][0], data["hinge"][0]["initial"]
        arm, mass = body["center_of_mass"][2], body["mass"]
        self.mass, self.arm, self.weight = mass, arm, -mass * data["gravity"][2]
        self.A = body["inertia"][0] + mass * arm**2  # about the point
        self.C = body["inertia"][2]
        w, x = initial["q"][:2]
        self.lean = 2 * np.arctan2(x, w)
        spin = np.array(initial["u"])
        vertical = np.array([0, np.sin(self.lean), np.cos(self.lean)])  # in body axes
        momentum = np.array([self.A, self.A, self.C]) * spin
        energy = 0.5 * self.A * (spin[0] ** 2 + spin[1] ** 2) + self.weight * arm * vertical[2]
        self.a, self.b = momentum[2] / self.A, momentum @ vertical / self.A
        self.alpha, self.beta = 2 * energy / self.A, 2 * self.weight * arm / self.A
        square = np.polynomial.Polynomial([self.b, -self.a]) ** 2
        cubic = np.polynomial.Polynomial([1, 0, -1]) * np.polynomial.Polynomial(
            [self.alpha, -self.beta]
        )
        self.low, self.high, self.third = np.sort((cubic - square).roots().real)
        self.rate = np.sqrt(self.beta * (self.third - self.low)) / 2
        self.modulus = (self.high - self.low) / (self.third - self.low)
        share = (vertical[2] - self.low) / (self.high - self.low)
        falling = spin[0] > 0  # the lean grows with a turn about x, the line of nodes
        phase = ellipkinc(np.arcsin(np.sqrt(share)), self.modulus)
        self.phase = -phase if falling else phase

    def height(self, t: float) -> float:
        """cos(theta)."""
        sn = ellipj(self.rate * t + self.phase, self.modulus)[0]
        return float(self.low + (self.high - self.low) * sn**2)

    def precession_rate(self, t: float) -> float:
        """Rate of the azimuth of the axis."""
        u = self.height(t)
        return float((self.b - self.a * u) / (1 - u * u))

    def steady(self, spin: float) -> Array:
        """Slow and fast precession rate at the initial lean."""
        quadratic = [self.A * np.cos(self.lean), -self.C * spin, self.weight * self.arm]
        return np.asarray(np.roots(quadratic).real, np.float64)


def simulate(data: dict[str, Any]) -> mstmm.Result:
    """Integrate and return the samples."""
    result = mstmm.compile(mstmm.Scene(**data)).simulate(
        t_end=TIMES[-1], method="dop853", rtol=1e-11, atol=1e-12, output_times=TIMES
    )
    assert result.success, result.message
    return result


def check_nutation(data: dict[str, Any]) -> None:
    """Statement 1."""
    top, result = Top(data), simulate(data)
    direction = axis(result.orientation("top"))
    heights = np.array([top.height(t) for t in TIMES])
    steps = [quad(top.precession_rate, s, t, epsabs=1e-12)[0] for s, t in pairwise(TIMES)]
    azimuth = np.unwrap(np.arctan2(direction[:, 1], direction[:, 0]))
    height = float(abs(direction[:, 2] - heights).max())
    turned = float(abs(azimuth - azimuth[0] - np.r_[0, np.cumsum(steps)]).max())
    energy = float(np.ptp(result.energy()))
    print(f"cos(theta) from {top.low:.6f} to {top.high:.6f}: error {height:.1e}")
    print(f"precession over {azimuth[-1] - azimuth[0]:.3f} rad: error {turned:.1e}", end="")
    print(f", energy {energy:.1e} J")
    assert height < 1e-9 and turned < 1e-8 and energy < 1e-9
    seen = direction[:, 2]
    assert top.low - 1e-9 < seen.min() < top.low + 1e-3
    assert top.high - 1e-3 < seen.max() < top.high + 1e-9


def check_steady(data: dict[str, Any]) -> None:
    """Statement 2."""
    top, spin = Top(data), data["hinge"][0]["initial"]["u"][2]
    for rate in top.steady(spin):
        data["hinge"][0]["initial"]["u"] = [0.0, float(rate * np.sin(top.lean)), spin]
        result = simulate(data)
        direction = axis(result.orientation("top"))
        angle = -np.pi / 2 + rate * TIMES
        expected = np.stack([np.cos(angle), np.sin(angle)], 1) * np.sin(top.lean)
        error = float(abs(direction[:, :2] - expected).max())
        push = -top.mass * top.arm * rate**2 * expected
        force = result.force("point")
        load = float(abs(force - np.c_[push, np.full(len(push), top.weight)]).max())
        print(f"steady precession at {rate:.4f} rad/s: axis {error:.1e}, force {load:.1e} N")
        assert error < 1e-7
        assert load < 1e-6 * max(1.0, rate**2)


def main() -> None:
    """Both statements."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    check_nutation(data)
    check_steady(data)


if __name__ == "__main__":
    main()
