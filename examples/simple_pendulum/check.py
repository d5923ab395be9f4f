"""Simple pendulum, problem A01 of the IFToMM multibody benchmark library.

Statement: position at t = 1, 5 and 10 s against the exact motion (Jacobi's elliptic functions,
and numbers computed once with 25 digits), the period 4 sqrt(L/g) K(1/2), energy, and the rod's
force, which at the lowest point is three times the weight.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.special import ellipj, ellipk

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
GRAVITY, LENGTH = 9.81, 1.0
EXACT = {  # 25-digit integration, rounded
    1.0: (0.986291751131875, -0.165010853125541),
    5.0: (-0.942305435043757, -0.334754338414001),
    10.0: (-0.275087462576117, -0.961419205099125),
}


def main() -> None:
    """Integrate 10 s and compare."""
    period = 4 * np.sqrt(LENGTH / GRAVITY) * ellipk(0.5)
    times = np.r_[sorted(EXACT), np.linspace(0, 4, 9) * period / 4]
    order = np.argsort(times)
    result = mstmm.compile(mstmm.load_scene(SCENE)).simulate(
        t_end=10.0, method="dop853", rtol=1e-12, atol=1e-13, output_times=times[order]
    )
    assert result.success, result.message
    place = np.empty((len(times), 3))
    place[order] = result.position("pendulum.mass")
    error = float(abs(place[:3, :2] - np.array(list(EXACT.values()))).max())

    # From the lowest point, sin(phi / 2) = sqrt(1/2) sn(w t, 1/2); the release is at -K.
    sn = ellipj(np.sqrt(GRAVITY / LENGTH) * times - ellipk(0.5), 0.5)[0]
    half = np.arcsin(np.sqrt(0.5) * sn)
    closed = LENGTH * np.stack([np.sin(2 * half), -np.cos(2 * half)], axis=1)
    elliptic = float(abs(place[:, :2] - closed).max())

    force = np.empty((len(times), 3))
    force[order] = result.force("pivot")
    lowest = force[3 + 2]  # a quarter of the period
    drift = float(np.ptp(result.energy()))
    print(f"25-digit values {error:.1e} m, elliptic functions {elliptic:.1e} m")
    print(f"force at the lowest point {lowest[1]:.9f} N = 3 x {GRAVITY}, energy {drift:.1e} J")
    assert abs(period - 2.36784194757624) < 1e-13
    assert error < 1e-9 and elliptic < 1e-9
    assert abs(lowest - [0, 3 * GRAVITY, 0]).max() < 1e-7
    assert drift < 1e-9


if __name__ == "__main__":
    main()
