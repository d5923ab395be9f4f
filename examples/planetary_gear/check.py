"""A planetary gear whose ring hangs on a spring.

Statements: (1) of the six rows of the teeth four say anything, whatever the number of planets, and
the mobility is 2.  (2) Willis' equation 0.03 sun + 0.07 ring = 0.1 carrier holds to 1e-12 rad at
the end.  (3) A constant torque on the sun turns both motions as two coordinates with a constant
mass matrix and one spring do, by eigenvectors, within 1e-9 of the largest angle.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.linalg

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
SUN, PLANET, RING = 0.03, 0.02, 0.07
#: Of the shafts of sun, ring and carrier with what it carries, and of the planets, kg m^2.
MOMENTS = np.array([2e-4, 3e-3, 4e-4 + 3 * 0.2 * 0.05**2, 5e-5, 5e-5, 5e-5])
TORQUE, STIFFNESS = 0.3, 40.0


def motion(times: np.ndarray) -> np.ndarray:
    """Angles of sun and ring (times, 2) from rest: each eigenvector under its share of the load."""
    carrier = np.array([SUN, RING]) / (SUN + RING)
    planet = np.array([-SUN / PLANET, 0.0]) + (1 + SUN / PLANET) * carrier
    ways = np.array([[1, 0], [0, 1], carrier, planet, planet, planet])
    squares, shapes = scipy.linalg.eigh(np.diag([0.0, STIFFNESS]), ways.T @ np.diag(MOMENTS) @ ways)
    squares[0] = 0.0
    loads = shapes.T @ [TORQUE, 0.0]
    free = loads[0] * times**2 / 2
    swing = loads[1] * (1 - np.cos(np.sqrt(squares[1]) * times)) / squares[1]
    return np.stack([free, swing], axis=-1) @ shapes.T


def main() -> None:
    """All three statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    loops = model.loops
    print(loops.summary)
    assert (loops.rank, len(loops.constraint_rows), loops.mobility) == (4, 6, 2)

    times = np.linspace(0.0, 0.5, 201)
    result = model.simulate(0.5, "dop853", rtol=1e-11, output_times=times)
    assert result.success, result.message
    sun, ring, carrier = result.q[-1, :3]
    open_by = abs(SUN * sun + RING * ring - (SUN + RING) * carrier) / (SUN + RING)
    print(f"Willis' equation is off by {open_by:.1e} rad after {sun / (2 * np.pi):.1f} turns")
    assert open_by < 1e-12

    wanted = motion(times)
    error = np.abs(result.q[:, :2] - wanted).max() / np.abs(wanted).max()
    print(f"angles off by {error:.1e} of the largest")
    assert error < 1e-9


if __name__ == "__main__":
    main()
