"""Branched tree: the sweep against Hamilton's equations of the same tree.

Statement: the six coordinates agree with a second program that knows no acceleration at all:
below, p = M(q) dq/dt and dp/dt = 1/2 d(dq/dt' M dq/dt)/dq - dV/dq, the mass matrix from partial
velocities and all derivatives by complex step, integrated by SciPy.  Energy stays constant.
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
TIMES = np.linspace(0.0, 1.0, 21)
STEP = 1e-30
Array = NDArray[np.float64]


def turn(axis: Any, angle: Any) -> Any:
    """Rotation about a unit vector (Rodrigues)."""
    x, y, z = axis
    tilde = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * tilde + (1 - np.cos(angle)) * tilde @ tilde


class Place:
    """A frame: origin r, axes R, and their rates per unit speed (3, 6) each."""

    def __init__(self, r: Any, R: Any, v: Any, w: Any) -> None:
        self.r, self.R, self.v, self.w = r, R, v, w

    def at(self, offset: Any, R: Any = None) -> Place:
        """A frame fixed in this one."""
        arm = self.R @ np.asarray(offset)
        axes = self.R if R is None else self.R @ R
        return Place(self.r + arm, axes, self.v + np.cross(self.w.T, arm).T, self.w)

    def slide(self, axis: Any, k: int, q: Any) -> Place:
        """Coordinate k moves along an axis of this frame."""
        moved = self.at(np.asarray(axis) * q)
        moved.v = moved.v.copy()
        moved.v[:, k] = self.R @ np.asarray(axis)
        return moved

    def spin(self, axis: Any, k: int, q: Any) -> Place:
        """Coordinate k turns about an axis of this frame."""
        w = self.w.copy()
        w[:, k] = self.R @ np.asarray(axis)
        return Place(self.r, self.R @ turn(axis, q), self.v, w)


def roll_pitch_yaw(angles: Any) -> Any:
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    roll, pitch, yaw = angles
    return turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)


class Tree:
    """Positions and partial velocities of the scene's four bodies, and its potential."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.body = {body["name"]: body for body in data["body"]}
        self.hinge = {hinge["name"]: hinge for hinge in data["hinge"]}
        self.tie = data["spring"][0]["law"]
        self.gravity = np.array(data["gravity"], float)
        self.start = np.concatenate([hinge["initial"]["q"] for hinge in data["hinge"]])
        self.speeds = np.concatenate([hinge["initial"]["u"] for hinge in data["hinge"]])

    def frames(self, q: Any) -> dict[str, Place]:
        """Input frame of every body; q = [root 2, shoulder, rail, sleeve 2]."""
        zero, h, ends = np.zeros((3, 6), q.dtype), self.hinge, self.body["trunk"]["ends"]
        trunk = Place(np.array(h["root"]["position"], float), np.eye(3), zero, zero)
        trunk = trunk.spin(h["root"]["axis"], 0, q[0]).spin(h["root"]["axis2"], 1, q[1])
        left = trunk.at(ends["left"]["position"], roll_pitch_yaw(ends["left"]["orientation"]))
        left = left.spin(h["shoulder"]["axis"], 2, q[2])
        slider = left.at(self.body["left"]["ends"]["rail"]).slide(h["rail"]["axis"], 3, q[3])
        axis = h["sleeve"]["axis"]
        right = trunk.at(ends["right"]).slide(axis, 4, q[4]).spin(axis, 5, q[5])
        return {"trunk": trunk, "left": left, "slider": slider, "right": right}

    def mass_and_potential(self, q: Any) -> tuple[Any, Any]:
        """Mass matrix (6, 6) and potential energy."""
        frames, M, V = self.frames(q), 0.0, 0.0
        for name, place in frames.items():
            body = self.body[name]
            xx, yy, zz, xy, xz, yz = (*body["inertia"], 0, 0, 0)[:6]
            J = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            center, w = place.at(body["center_of_mass"]), place.R.T @ place.w
            M = M + body["mass"] * center.v.T @ center.v + w.T @ J @ w
            V = V - body["mass"] * self.gravity @ center.r
        for name, own in (("rail", q[3:4]), ("sleeve", q[4:])):
            law = self.hinge[name]["law"]
            V = V + 0.5 * np.sum(np.array(law["stiffness"]) * (own - np.array(law["rest"])) ** 2)
        tips = [frames[n].at(self.body[n]["ends"]["tip"]).r for n in ("left", "right")]
        length = np.sqrt(np.sum((tips[1] - tips[0]) ** 2))
        return M, V + 0.5 * self.tie["stiffness"] * (length - self.tie["rest"]) ** 2

    def rate(self, t: float, state: Array) -> Array:
        """Hamilton's equations: rates of q and of the momenta p."""
        q, p = state[:6], state[6:]
        u = np.linalg.solve(self.mass_and_potential(q)[0], p)
        force = np.zeros(6)
        for k in range(6):
            M, V = self.mass_and_potential(q + 1j * STEP * np.eye(6)[k])
            force[k] = (0.5 * u @ M.imag @ u - V.imag) / STEP
        return np.r_[u, force]


def main() -> None:
    """Run both programs and compare."""
    with SCENE.open("rb") as file:
        tree = Tree(tomllib.load(file))
    result = mstmm.compile(mstmm.load_scene(SCENE)).simulate(
        t_end=TIMES[-1], method="dop853", rtol=1e-11, atol=1e-12, output_times=TIMES
    )
    assert result.success, result.message
    start = np.r_[tree.start, tree.mass_and_potential(tree.start)[0] @ tree.speeds]
    other = solve_ivp(tree.rate, (0.0, TIMES[-1]), start, "DOP853", TIMES, rtol=1e-9, atol=1e-10)
    error = float(abs(result.q - other.y[:6].T).max())
    energies = []
    for q, u in zip(result.q, result.u, strict=True):
        M, V = tree.mass_and_potential(q)
        energies.append(0.5 * u @ M @ u + V)
    drift, ours = float(np.ptp(energies)), float(np.ptp(result.energy()))
    print(f"coordinates {error:.1e}, energy {drift:.1e} J, as the engine reports it {ours:.1e} J")
    assert error < 3e-8
    assert drift < 3e-9 and ours < 3e-9


if __name__ == "__main__":
    main()
