"""A two-link arm that bends by centimetres, against a program for geometrically exact beams.

Statement: over 1.2 s the payload's path, both joint angles and the shoulder's effort are those of
Lagrange's equations, written below, of two inextensible beams whose unknowns are the angles of
their axes: no floating frames, no shapes in common, deflections of any size.  The error falls with
the number of shapes.
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
TIMES = np.linspace(0.0, 1.2, 241)
TERMS, POINTS = 4, 10
UP = np.array([0.0, 9.81])
Array = NDArray[np.float64]


class ExactArm:
    """Angle of each axis: polynomial of s in [0, 1]; unknowns y = [q1, a1 .. a4, q2, b1 .. b4],
    with q1, q2 the angles of the roots against the ground."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.upper, self.lower = (_link(beam) for beam in data["beam"])
        self.motor, self.payload = data["body"]
        self.size = 2 * (TERMS + 1)

    def rates(self, t: float, y: Array) -> Array:
        """M y'' + h = loads; places r'' = J y'' + b."""
        q, u = np.split(y, 2)
        half = self.size // 2
        one = self._parts(self.upper, q[:half], u[:half], slice(0, half))
        two = self._parts(self.lower, q[half:], u[half:], slice(half, self.size))
        M, h = np.zeros((self.size, self.size)), np.zeros(self.size)

        def add(mass: Array, J: Array, b: Array) -> None:
            """Particles: J (n, 2, size), b (n, 2)."""
            heavy = (mass[:, None, None] * J).reshape(-1, self.size).T
            M[:] += heavy @ J.reshape(-1, self.size)
            h[:] += heavy @ (b + UP).ravel()

        elbow = one["J"][-1], one["b"][-1]
        add(self.upper["mass"], one["J"][:-1], one["b"][:-1])
        add(self.lower["mass"], two["J"][:-1] + elbow[0], two["b"][:-1] + elbow[1])
        add(np.array([self.motor["mass"]]), elbow[0][None], elbow[1][None])
        tip = two["J"][-1] + elbow[0], two["b"][-1] + elbow[1]
        add(np.array([self.payload["mass"]]), tip[0][None], tip[1][None])
        for link, body, part in (
            (self.upper, self.motor, slice(1, half)),
            (self.lower, self.payload, slice(half + 1, None)),
        ):  # fmt: skip
            turn = np.zeros(self.size)
            turn[part.start - 1 :][: TERMS + 1] = 1.0  # of the tip's angle
            M += body["inertia"][2] * np.outer(turn, turn)
            h[part] += link["K"] @ q[part]
        first = np.zeros(self.size)
        first[0] = 1.0
        second = np.zeros(self.size)
        second[half], second[:half] = 1.0, -1.0  # the elbow: root of the lower on tip of the upper
        shoulder = 120 * (0.6 * (1 - np.cos(4 * t)) - first @ q) - 5 * (first @ u)
        bend = 40 * (-0.9 * np.sin(3 * t) - second @ q) - 1.5 * (second @ u)
        return np.r_[u, np.linalg.solve(M, first * shoulder + second * bend - h)]

    def _parts(self, link: dict[str, Any], q: Array, u: Array, at: slice) -> dict[str, Array]:
        """J and b of the Gauss points and, last, of the tip, from the link's root."""
        shape, sums = link["shape"], link["sums"]
        theta, omega = shape @ q, shape @ u
        along = np.stack([np.cos(theta), np.sin(theta)], 1)
        across = np.stack([-along[:, 1], along[:, 0]], 1)
        J = np.zeros((len(sums), 2, self.size))
        for d in range(2):
            J[:, d, at] = sums @ (across[:, d, None] * shape)
        return {"J": J, "b": -sums @ (along * omega[:, None] ** 2)}

    def tip(self, q: Array) -> Array:
        """Places (n, 2) of the payload; q (size, n)."""
        place = np.zeros((2, q.shape[1]))
        for link, part in ((self.upper, q[: TERMS + 1]), (self.lower, q[TERMS + 1 :])):
            theta = link["shape"] @ part
            place += np.stack([link["sums"][-1] @ np.cos(theta), link["sums"][-1] @ np.sin(theta)])
        return place.T

    def run(self) -> tuple[Array, Array, Array]:
        """Payload (n, 2), angles of both joints (n, 2) and shoulder effort (n,) at TIMES."""
        done = solve_ivp(
            self.rates, (0, TIMES[-1]), np.zeros(2 * self.size), "LSODA", TIMES,
            rtol=1e-6, atol=1e-7,
        )  # fmt: skip
        q, u = np.split(done.y, 2)
        half = self.size // 2
        angles = np.stack([q[0], q[half] - q[:half].sum(axis=0)], 1)
        effort = 120 * (0.6 * (1 - np.cos(4 * TIMES)) - q[0]) - 5 * u[0]
        return self.tip(q), angles, effort


def _link(beam: dict[str, Any]) -> dict[str, Any]:
    """Quadrature of a beam: angles at Gauss points, integrals from the root, stiffness."""
    length = beam["length"]
    x, w = np.polynomial.legendre.leggauss(POINTS)
    s, w = (x + 1) / 2, w / 2
    powers = np.arange(TERMS + 1)
    bend = powers[1:] * s[:, None] ** (powers[1:] - 1)
    degrees = np.arange(POINTS)
    to = np.r_[s, 1.0][:, None] ** (degrees + 1) / (degrees + 1)
    return {
        "shape": s[:, None] ** powers, "mass": beam["mass_per_length"] * length * w,
        "K": beam["bending_stiffness"] / length * bend.T @ (w[:, None] * bend),
        "sums": length * to @ np.linalg.inv(s[:, None] ** degrees),
    }  # fmt: skip


def run(data: dict[str, Any], modes: int) -> mstmm.Result:
    """mstmm's arm with so many shapes a link."""
    for beam in data["beam"]:
        beam["modes"] = {"y": modes}
    result = mstmm.compile(mstmm.Scene(**data)).simulate(
        t_end=TIMES[-1], rtol=1e-6, atol=1e-8, output_times=TIMES
    )
    assert result.success, result.message
    return result


def main() -> None:
    """Compare 2, 3 and 4 shapes."""
    data = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    place, angles, effort = ExactArm(data).run()
    errors = []
    for modes in (2, 3, 4):
        result = run(data, modes)
        pair = (result.coordinates(name)[:, 0] for name in ("shoulder", "elbow"))
        joints = np.stack(list(pair), 1)
        found = (
            abs(result.position("payload")[:, :2] - place).max(), abs(joints - angles).max(),
            abs(result.effort("shoulder")[:, 0] - effort).max(),
        )  # fmt: skip
        errors.append(found)
        print(f"{modes} shapes: payload {found[0]:.1e} m, joints {found[1]:.1e} rad, ", end="")
        print(f"shoulder {found[2]:.1e} of {abs(effort).max():.1f} N m")
    bent = abs(result.deflection("upper", 0.3)[:, 1]).max()
    print(f"the upper link bends by {1e3 * bent:.0f} mm")
    assert bent > 0.01
    assert errors[-1][0] < 1e-3 and errors[-1][1] < 1e-3 and errors[-1][2] < 0.1
    assert errors[-1][2] < errors[0][2] / 4


if __name__ == "__main__":
    main()
