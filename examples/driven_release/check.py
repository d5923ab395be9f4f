"""A driven hinge that is released: reaction effort, force, work and the free motion after it.

Statement: while driven, the effort is J theta'' + m g c sin(theta) of the prescribed motion and
the pin carries m (a - g); its work is the energy of the rod; after the release at t = 1 s the
effort is zero and the rod swings by Jacobi's elliptic functions from where it was let go.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson
from scipy.special import ellipj, ellipkinc

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
MASS, ARM, GRAVITY = 2.0, 0.4, 9.81
INERTIA = 0.11 + MASS * ARM**2
AMPLITUDE, RATE, RELEASE = 0.5, 3.0, 1.0
Array = NDArray[np.float64]


def released(t: Array) -> Array:
    """Angle after the release: sin(theta / 2) = k sn(w (t - 1) + F, k^2)."""
    w = np.sqrt(MASS * GRAVITY * ARM / INERTIA)
    angle, speed = AMPLITUDE * np.sin(RATE), AMPLITUDE * RATE * np.cos(RATE)
    square = np.sin(angle / 2) ** 2 + (speed / (2 * w)) ** 2
    phase = ellipkinc(np.arcsin(np.sin(angle / 2) / np.sqrt(square)), square)
    phase = phase if speed > 0 else 2 * ellipkinc(np.pi / 2, square) - phase
    sn = ellipj(w * (t - RELEASE) + phase, square)[0]
    return np.asarray(2 * np.arcsin(np.sqrt(square) * sn))


def main() -> None:
    """Integrate across the release and compare."""
    result = mstmm.compile(mstmm.load_scene(SCENE)).simulate(
        t_end=4.0, method="dop853", rtol=1e-11, atol=1e-12, output_times=np.linspace(0, 4, 1201)
    )
    assert result.success, result.message
    before, after = result.t[result.t < RELEASE], result.t[result.t > RELEASE]
    n, m = len(before), len(result.t) - len(after)
    assert n >= 300 and len(after) >= 899
    angle = AMPLITUDE * np.sin(RATE * before)
    speed = AMPLITUDE * RATE * np.cos(RATE * before)
    turn = -(RATE**2) * angle
    effort = INERTIA * turn + MASS * GRAVITY * ARM * np.sin(angle)
    ours = result.effort("motor")[:, 0]
    driven = float(abs(result.q[:n, 0] - angle).max() + abs(result.u[:n, 0] - speed).max())
    torque, after_torque = float(abs(ours[:n] - effort).max()), float(abs(ours[m:]).max())
    radial, across = -MASS * ARM * speed**2, MASS * ARM * turn
    along = np.stack([np.sin(angle), -np.cos(angle)], 1)
    side = np.stack([np.cos(angle), np.sin(angle)], 1)
    force = radial[:, None] * along + across[:, None] * side + [0, MASS * GRAVITY]
    load = float(abs(result.force("motor")[:n, :2] - force).max())
    moment = result.moment("motor")[:, 2] - ours
    balance = float(np.ptp(result.energy() - result.work))
    free = float(abs(result.q[m:, 0] - released(after)).max())

    work = simpson(ours[:n] * speed, x=before)
    kinetic = 0.5 * INERTIA * (speed[-1] ** 2 - speed[0] ** 2)
    energy = kinetic + MASS * GRAVITY * ARM * (np.cos(angle[0]) - np.cos(angle[-1]))
    print(f"driven motion {driven:.1e}, effort {torque:.1e} N m, force {load:.1e} N")
    print(f"work {work:.6f} J, energy {energy:.6f} J; released: angle {free:.1e} rad")
    print(f"energy less work {balance:.1e} J")
    assert driven < 1e-14 and torque < 1e-13 and load < 1e-13
    assert abs(moment).max() < 1e-13 and balance < 1e-9
    assert after_torque < 1e-12
    assert abs(work - energy) < 1e-7
    assert free < 1e-9


if __name__ == "__main__":
    main()
