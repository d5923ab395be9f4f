"""Three-pin arm: the sweep against Kane's equations written out for this arm.

Statement: the three angles agree with a second program (below: partial velocities of mass
centres and bodies, mass matrix of three rows, integrated by SciPy), total energy stays constant
and the angular momentum about the vertical axis of the first pin is conserved.
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
TIMES = np.linspace(0.0, 2.0, 81)
Array = NDArray[np.float64]


def turn(axis: int, angle: float) -> Array:
    """Rotation about a coordinate axis (0, 1, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[j, j], matrix[j, k], matrix[k, j], matrix[k, k] = c, -s, s, c
    return matrix


class Kane:
    """Partial velocities of an open chain of pins about the bodies' z axes."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.gravity = np.array(data["gravity"], float)
        self.roll = [hinge.get("orientation", [0, 0, 0])[0] for hinge in data["hinge"]]
        self.start = np.array([hinge["initial"]["q"][0] for hinge in data["hinge"]] + [0.0] * 3)
        self.bodies = []
        for body in data["body"]:
            xx, yy, zz, xy, xz, yz = body["inertia"]
            J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            center, tip = np.array(body["center_of_mass"]), np.array(body["ends"]["tip"])
            self.bodies.append((body["mass"], J, center, tip))

    def sums(self, q: Array, u: Array) -> tuple[Array, Array, float, float]:
        """Mass matrix, generalised forces, total energy, angular momentum about the z axis."""
        n = len(q)
        M, F, energy, momentum = np.zeros((n, n)), np.zeros(n), 0.0, 0.0
        R, point = np.eye(3), np.zeros(3)
        w_columns, v_columns = np.zeros((3, n)), np.zeros((3, n))  # of the body, of its input end
        w, w_bias, a_bias = np.zeros(3), np.zeros(3), np.zeros(3)
        for i, (m, J0, c0, tip0) in enumerate(self.bodies):
            R = R @ turn(0, self.roll[i]) @ turn(2, q[i])
            axis, J, c, tip = R[:, 2], R @ J0 @ R.T, R @ c0, R @ tip0
            w_columns[:, i] = axis
            w_bias = w_bias + np.cross(w, axis) * u[i]
            w = w + axis * u[i]
            v_center = v_columns + np.cross(w_columns.T, c).T
            a_center = a_bias + np.cross(w_bias, c) + np.cross(w, np.cross(w, c))
            gyro = J @ w_bias + np.cross(w, J @ w)
            M += m * v_center.T @ v_center + w_columns.T @ J @ w_columns
            F += m * v_center.T @ (self.gravity - a_center) - w_columns.T @ gyro
            v = v_center @ u
            energy += 0.5 * m * (v @ v) + 0.5 * w @ J @ w - m * self.gravity @ (point + c)
            momentum += (np.cross(point + c, m * v) + J @ w)[2]
            a_bias = a_bias + np.cross(w_bias, tip) + np.cross(w, np.cross(w, tip))
            v_columns = v_columns + np.cross(w_columns.T, tip).T
            point = point + tip
        return M, F, energy, momentum

    def rate(self, t: float, state: Array) -> Array:
        """Time derivative of angles and speeds."""
        M, F, _, _ = self.sums(state[:3], state[3:])
        return np.r_[state[3:], np.linalg.solve(M, F)]


def main() -> None:
    """Run both programs and compare."""
    with SCENE.open("rb") as file:
        kane = Kane(tomllib.load(file))
    result = mstmm.compile(mstmm.load_scene(SCENE)).simulate(
        t_end=TIMES[-1], method="dop853", rtol=1e-11, atol=1e-12, output_times=TIMES
    )
    assert result.success, result.message
    other = solve_ivp(
        kane.rate, (0.0, TIMES[-1]), kane.start, "DOP853", TIMES, rtol=1e-11, atol=1e-12
    )
    angle = float(abs(result.q - other.y[:3].T).max())
    _, _, energies, momenta = zip(
        *(kane.sums(q, u) for q, u in zip(result.q, result.u, strict=True)), strict=True
    )
    drift, momentum = np.ptp(energies), np.ptp(momenta)
    ours = abs(np.diff(result.energy()) - np.diff(energies)).max()
    print(f"angles {angle:.1e} rad, energy {drift:.1e} J, momentum {momentum:.1e} N m s")
    assert angle < 1e-9
    assert drift < 1e-8 and momentum < 1e-9
    assert ours < 1e-11


if __name__ == "__main__":
    main()
