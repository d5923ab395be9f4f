"""A thin cantilever under a weight in a direction between the axes of its section.

Statement: in seven directions of the weight the tip of the beam agrees within 1e-8 m with a second
program below.  It solves the equations of the rod along its axis as a boundary value problem and
uses neither strain shapes nor segments.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
LENGTH, WEIGHT = 0.508, 8.896
#: Torsional stiffness, bending about y, about z.
STIFFNESS = np.array([3.1037964, 36.279364, 2.4287344])
ANGLES = np.radians([0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0])
Array = NDArray[np.float64]


def tip(angle: float) -> Array:
    """Tip of the beam in equilibrium, from the scene."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    data["constants"]["angle"] = angle
    model = mstmm.compile(mstmm.Scene(**data))
    return np.asarray(model.positions(model.equilibrium(), "beam.tip"))


def rotate(quaternion: Array, vectors: Array) -> Array:
    """Vectors (3, m) rotated by unit quaternions (4, m)."""
    w, u = quaternion[0], quaternion[1:]
    cross = np.cross(u, vectors, axis=0)
    return vectors + 2 * (w * cross + np.cross(u, cross, axis=0))


def rod_tip(angle: float) -> Array:
    """Tip of an inextensible rod: r' = R e_x, q' = q kappa / 2, m' = -r' x f along its axis."""
    force = WEIGHT * np.array([0.0, -np.sin(angle), -np.cos(angle)])

    def slopes(_: Array, y: Array) -> Array:
        quaternion, moment = y[3:7], y[7:]
        back = np.vstack([quaternion[:1], -quaternion[1:]])
        curvature = rotate(back, moment) / STIFFNESS[:, None]
        axis = rotate(quaternion, np.tile([[1.0], [0.0], [0.0]], y.shape[1]))
        w, u = quaternion[0], quaternion[1:]
        product = [
            -np.sum(u * curvature, axis=0),
            *(w * curvature + np.cross(u, curvature, axis=0)),
        ]
        return np.vstack([axis, np.array(product) / 2, -np.cross(axis, force[:, None], axis=0)])

    def conditions(root: Array, end: Array) -> Array:
        clamped = root[:7] - np.array([0.0, 0, 0, 1, 0, 0, 0])
        return np.concatenate([clamped, end[7:]])

    x = np.linspace(0.0, LENGTH, 30)
    guess = np.zeros((10, len(x)))
    guess[0], guess[3] = x, 1.0
    found = solve_bvp(slopes, conditions, x, guess, tol=1e-9, max_nodes=10_000)
    assert found.success, found.message
    return np.asarray(found.y[:3, -1])


def main() -> None:
    """Compare both programs in all directions."""
    for angle in ANGLES:
        found, expected = tip(float(angle)), rod_tip(float(angle))
        worst = np.abs(found - expected).max()
        print(f"{np.degrees(angle):5.1f} degrees: tip {found.round(6)} m, difference {worst:.1e} m")
        assert worst < 1e-8


if __name__ == "__main__":
    main()
