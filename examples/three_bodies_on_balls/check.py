"""Three bodies on ball hinges: the sweep against Newton-Euler equations with all reactions.

Statement: orientations, tip and hinge forces agree with a second program (below: nine angular
accelerations and nine hinge force components solved together, integrated by SciPy), and the
total energy stays constant.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm

SCENE = Path(__file__).with_name("scene.toml")
TIMES = np.linspace(0.0, 2.0, 41)
Array = NDArray[np.float64]


def tilde(a: Array) -> Array:
    """Matrix of the cross product a x."""
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def rotation(quaternion: Array) -> Array:
    """Body to inertial axes from w, x, y, z."""
    w, v = quaternion[0], quaternion[1:]
    matrix = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * tilde(v)
    return np.asarray(matrix / (quaternion @ quaternion))


def product(a: Array, b: Array) -> Array:
    """Quaternion product a b."""
    scalar = a[0] * b[0] - a[1:] @ b[1:]
    return np.r_[scalar, a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])]


def tensor(entries: list[float]) -> Array:
    """Inertia tensor from xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class NewtonEuler:
    """State: for every body its own quaternion and its angular velocity in inertial axes."""

    def __init__(self, data: dict[str, Any]) -> None:
        bodies = data["body"]
        self.count = len(bodies)
        self.gravity = np.array(data["gravity"], float)
        self.mass = [body["mass"] for body in bodies]
        self.center = [np.array(body["center_of_mass"]) for body in bodies]
        self.tip = [np.array(body["ends"]["tip"]) for body in bodies]
        self.inertia = [tensor(body["inertia"]) for body in bodies]
        turn, spin, state = np.array([1.0, 0, 0, 0]), np.zeros(3), []
        for hinge in data["hinge"]:
            turn = product(turn, np.array(hinge["initial"]["q"]))
            spin = spin + rotation(turn) @ np.array(hinge["initial"]["u"])
            state.append(np.r_[turn, spin])
        self.start = np.concatenate(state)

    def solve(self, state: Array) -> tuple[Array, Array]:
        """Angular accelerations (3, 3) and hinge forces on the outboard sides (3, 3)."""
        n, parts = self.count, state.reshape(self.count, 7)
        A, b = np.zeros((6 * n, 6 * n)), np.zeros(6 * n)
        reach, offset = np.zeros((3, 3 * n)), np.zeros(3)  # hinge point = reach @ alpha + offset
        for i in range(n):
            R, w = rotation(parts[i, :4]), parts[i, 4:]
            c, tip = R @ self.center[i], R @ self.tip[i]
            J, m, own = R @ self.inertia[i] @ R.T, self.mass[i], slice(3 * i, 3 * i + 3)
            center = reach.copy()
            center[:, own] -= tilde(c)
            force, rows = 3 * n + 3 * i, slice(6 * i, 6 * i + 3)
            A[rows, : 3 * n], A[rows, force : force + 3] = m * center, -np.eye(3)
            b[rows] = m * (self.gravity - offset - np.cross(w, np.cross(w, c)))
            rows = slice(6 * i + 3, 6 * i + 6)
            A[rows, own], A[rows, force : force + 3] = J, tilde(c)
            b[rows] = -np.cross(w, J @ w)
            if i + 1 < n:
                A[6 * i : 6 * i + 3, force + 3 : force + 6] = np.eye(3)
                A[rows, force + 3 : force + 6] = tilde(tip - c)
            reach[:, own] -= tilde(tip)
            offset = offset + np.cross(w, np.cross(w, tip))
        x = np.asarray(np.linalg.solve(A, b), np.float64)
        return x[: 3 * n].reshape(n, 3), x[3 * n :].reshape(n, 3)

    def rate(self, t: float, state: Array) -> Array:
        """Time derivative of the state."""
        alpha, _ = self.solve(state)
        parts = state.reshape(self.count, 7)
        turns = [product(np.r_[0.0, p[4:]], p[:4]) / 2 for p in parts]
        return np.concatenate([np.r_[q, a] for q, a in zip(turns, alpha, strict=True)])


def main() -> None:
    """Run both programs and compare."""
    with SCENE.open("rb") as file:
        reference = NewtonEuler(tomllib.load(file))
    result = mstmm.compile(mstmm.load_scene(SCENE)).simulate(
        t_end=TIMES[-1], method="dop853", rtol=1e-11, atol=1e-12, output_times=TIMES
    )
    assert result.success, result.message
    other = solve_ivp(
        reference.rate, (0.0, TIMES[-1]), reference.start, "DOP853", TIMES, rtol=1e-11, atol=1e-12
    )
    turn = tip = force = spin = 0.0
    for k, state in enumerate(other.y.T):
        alpha, forces = reference.solve(state)
        point = np.zeros(3)
        for i, part in enumerate(state.reshape(3, 7)):
            R = rotation(part[:4])
            point = point + R @ reference.tip[i]
            ours = rotation(result.orientation(f"body{i + 1}")[k])
            turn = max(turn, float(abs(ours - R).max()))
            ours = result.force(f"ball{2 * i}")[k]
            force = max(force, float(abs(ours - forces[i]).max()))
            ours = result.angular_acceleration(f"body{i + 1}")[k]
            spin = max(spin, float(abs(ours - alpha[i]).max()))
        tip = max(tip, float(abs(result.position("body3.tip")[k] - point).max()))
    energy = result.energy()
    drift = float(np.ptp(energy))
    print(f"orientation {turn:.1e}, tip {tip:.1e} m, force {force:.1e} N, ", end="")
    print(f"angular acceleration {spin:.1e} rad/s2, energy {drift:.1e} J")
    assert turn < 2e-9 and tip < 1e-9
    assert force < 1e-7 and spin < 1e-6
    assert drift < 2e-9


if __name__ == "__main__":
    main()
