"""Bricard's ring against its own closed form.

Statements: (1) by the count of its freedoms the ring is a structure, and yet it moves: of the five
rows of the pin that closes it four count, and one motion is left.  (2) All angles keep to
(1 + sin a)(1 + sin b) = 1, a that of every other pin, b that of those between, signs alternating.
(3) Over ten seconds the corner P3 is where one equation in one coordinate puts it, the rods as
thirty point masses on that curve, and energy stays.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
DATA = tomllib.loads(SCENE.read_text(encoding="utf-8"))
RODS = np.array([body["ends"]["tip"] for body in DATA["body"]], dtype=float)
AXES = np.array([hinge["axis"] for hinge in DATA["hinge"]], dtype=float)
SECTION, GRAVITY = 0.1, 9.81
TIMES = np.linspace(0.0, 10.0, 101)
Array = NDArray[np.float64]


def angles(a: Array | float, b: Array | float) -> Array:
    """Of the five pins before the closing one."""
    return np.stack([a, b, -a, b, a])


def places(a: float, b: float) -> tuple[Array, Array]:
    """Corners of the ring (5, 3), and six masses a rod (30, 3) with its moments of inertia."""
    turned, corner, corners, masses = np.eye(3), np.zeros(3), [], []
    for axis, rod, angle in zip(AXES, RODS, angles(a, b), strict=False):
        tilde = np.cross(np.eye(3), axis)
        turned = turned @ (np.eye(3) + np.sin(angle) * tilde + (1 - np.cos(angle)) * tilde @ tilde)
        # Six masses m/6 at d along each axis: the second moment m d^2/3 of a bar of length 2 d.
        reach = np.where(np.abs(rod) > 0.5, 1.0, SECTION) / 2
        arms = np.concatenate([np.diag(reach), -np.diag(reach)])
        masses.append(corner + (rod / 2 + arms) @ turned.T)
        corner = corner + turned @ rod
        corners.append(corner)
    return np.array(corners), np.concatenate(masses)


def onward(a: float, b: float) -> Array:
    """Direction along the curve on which (1 + sin a)(1 + sin b) stays."""
    return np.array([np.cos(b) * (1 + np.sin(a)), -np.cos(a) * (1 + np.sin(b))])


def rates(_: float, y: Array) -> Array:
    """Of a, b and the speed along the curve, by Lagrange's equation: with places x of the masses
    and their derivatives along the curve, x'.x' s'' + x'.x'' s'^2 + g x'_y = 0 in sum."""
    h, here, direction = 1e-4, y[:2], onward(*y[:2])
    bend = (onward(*(here + h * direction)) - onward(*(here - h * direction))) / (2 * h)
    low, middle, high = (
        places(*(here + s * direction + s**2 / 2 * bend))[1] for s in (-h, 0.0, h)
    )  # fmt: skip
    first, second = (high - low) / (2 * h), (high - 2 * middle + low) / h**2
    load = (first * second).sum() * y[2] ** 2 + GRAVITY * first[:, 1].sum()
    return np.append(direction * y[2], -load / (first**2).sum())


def main() -> None:
    """All three statements."""
    model = mstmm.compile(mstmm.load_scene(SCENE))
    loops = model.loops
    print(
        f"cut: {loops.cut_hinges[0]}; {loops.rank} of {len(loops.constraint_rows)} rows independent"
    )
    assert (len(loops.constraint_rows), loops.rank, loops.mobility) == (5, 4, 1)

    result = model.simulate(10.0, rtol=1e-9, output_times=TIMES)
    assert result.success, result.message
    pins = [model.coordinate_layout.hinges[f"pin{k}"].q_slice.start for k in range(1, 6)]
    q = result.q[:, pins].T
    kept = np.abs((1 + np.sin(q[0])) * (1 + np.sin(q[1])) - 1).max()
    alike = np.abs(q - angles(q[0], q[1])).max()
    print(f"off the curve of the angles by {kept:.1e}, angles unlike by {alike:.1e} rad")
    assert kept < 1e-8
    assert alike < 1e-8

    done = solve_ivp(rates, (0.0, 10.0), np.zeros(3), "DOP853", t_eval=TIMES, rtol=1e-9, atol=1e-9)
    wanted = np.array([places(a, b)[0][2] for a, b in done.y[:2].T])
    apart = np.abs(result.position("rod3.tip") - wanted).max()
    energy = result.energy()
    drift = np.abs(energy - energy[0]).max()
    print(f"P3 off by {apart:.1e} m, at the end {np.round(wanted[-1], 6)} m; energy by {drift:.1e}")
    assert apart < 1e-5
    assert drift < 1e-6


if __name__ == "__main__":
    main()
