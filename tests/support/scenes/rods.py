"""Chains of rods as scene dictionaries, and a sweep along them in long double.

The rods are 1 m long, their input end at the origin of their axes, their tip on x; pins turn about
z.  The chains of Rui, Wang, Zhang, ch. 5, as the failures of the transfer matrix product know them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Long = NDArray[np.longdouble]
Scene = dict[str, Any]

#: Uniform rod of 1 kg about its mass centre.
ROD = 1 / 12

#: Skew gravity: moves pins about any axis.
GRAVITY = (1.0, -9.0, 3.0)


def chain(
    kinds: Sequence[str],
    skew: float = 0.0,
    masses: Sequence[float] | None = None,
    inertia: Sequence[float] = (ROD, ROD, ROD),
    gravity: Sequence[float] = GRAVITY,
    start: Sequence[float] = (0.0, 0.0, 0.0),
) -> Scene:
    """Rods joined by hinges of these types; `skew` rad about x between the axes of neighbours.

    `inertia` is that of 1 kg about the mass centre; `start` is the orientation of the first hinge.
    """
    masses = masses or [1.0] * len(kinds)
    bodies, hinges = [], []
    for i, (kind, mass) in enumerate(zip(kinds, masses, strict=True)):
        tip = {"position": [1.0, 0, 0], "orientation": [skew, 0, 0]}
        bodies.append(
            {
                "name": f"rod{i}",
                "mass": mass,
                "center_of_mass": [0.5, 0, 0],
                "inertia": [mass * value for value in inertia],
                "ends": {"tip": tip},
            }
        )
        inboard = f"rod{i - 1}.tip" if i else "ground"
        hinge: Scene = {
            "name": f"hinge{i}", "type": kind, "inboard": inboard, "outboard": f"rod{i}",
        }  # fmt: skip
        if i == 0:
            hinge["orientation"] = list(start)
        hinges.append(hinge)
    return {"schema_version": 1, "gravity": list(gravity), "body": bodies, "hinge": hinges}


def drawn_state(scene: Scene, rng: np.random.Generator) -> tuple[Array, Array]:
    """Coordinates and speeds in +-1; quaternions within about 1.4 rad of the reference."""
    q, u = list[float](), list[float]()
    for hinge in scene["hinge"]:
        kind = hinge["type"]
        if kind in ("elastic", "free"):
            q += rng.uniform(-1, 1, 3).tolist()
        if kind in ("ball", "elastic", "free"):
            turned = np.append(1.0, rng.uniform(-0.5, 0.5, 3))
            q += (turned / np.linalg.norm(turned)).tolist()
        else:
            q.append(rng.uniform(-1, 1))
        u += rng.uniform(-1, 1, {"ball": 3, "elastic": 6, "free": 6}.get(kind, 1)).tolist()
    return np.array(q), np.array(u)


# --- long double ------------------------------------------------------------------------------


def precise_accelerations(scene: Scene, q: Array, u: Array) -> Array:
    """udot of a chain of pins or of balls by a Riccati sweep of its own, in long double.

    Body axes, input ends: a = [acceleration; angular acceleration], f = S a + e with f = [force;
    moment]; what hinge H passes inwards is S - Y^T Y, Y = L^-1 H^T S, L L^T = H^T S H.  Gravity
    enters as the acceleration of the ground.
    """
    count, ball = len(scene["body"]), scene["hinge"][0]["type"] == "ball"
    turns = [_turn(scene, q, i, ball) for i in range(count)]
    subspace = np.eye(6, dtype=np.longdouble)[:, 3 if ball else 5 :]
    width = subspace.shape[1]
    speeds = [subspace[3:] @ _long(u[width * i : width * (i + 1)]) for i in range(count)]
    omega = [np.zeros(3, np.longdouble)]
    for turn, speed in zip(turns, speeds, strict=True):
        omega.append(turn.T @ omega[-1] + speed)
    bias = [
        np.concatenate([np.zeros(3, np.longdouble), np.cross(turn.T @ inner, speed)])
        for turn, inner, speed in zip(turns, omega, speeds, strict=False)
    ]
    tip = _long([1, 0, 0])
    S, e = np.zeros((6, 6), np.longdouble), np.zeros(6, np.longdouble)
    pivots: list[tuple[Long, Long, Long]] = []
    for i in reversed(range(count)):
        mass, load = _body(scene["body"][i], omega[i + 1])
        S, e = mass + S, load + e
        L = _factor(subspace.T @ S @ subspace)
        Y, y = _forward(L, subspace.T @ S), -_forward(L, subspace.T @ (S @ bias[i] + e))
        pivots.append((L, Y, y))
        S, e = S - Y.T @ Y, e + S @ bias[i] + Y.T @ y
        if i:
            X = np.eye(6, dtype=np.longdouble)
            X[:3, 3:] = -_tilde(tip)
            X = _twist_rotation(turns[i].T) @ X
            S, e = X.T @ S @ X, X.T @ (S @ _centripetal_acceleration(turns[i], omega[i]) + e)
    a = np.concatenate([-_long(scene["gravity"]), np.zeros(3, np.longdouble)])
    udot = []
    for i, (L, Y, y) in enumerate(reversed(pivots)):
        if i:
            a = np.concatenate([a[:3] + np.cross(a[3:], tip), a[3:]])
        a = _twist_rotation(turns[i].T) @ a + (
            _centripetal_acceleration(turns[i], omega[i]) if i else 0
        )
        udot.append(_backward(L, y - Y @ a))
        a = a + subspace @ udot[-1] + bias[i]
    return np.concatenate(udot).astype(float)


def _long(values: Any) -> Long:
    return np.asarray(values, dtype=np.longdouble)


def _centripetal_acceleration(turn: Long, omega: Long) -> Long:
    """omega x (omega x tip) of the inboard body in outboard axes, as a twist."""
    centripetal = np.cross(omega, np.cross(omega, _long([1, 0, 0])))
    return np.concatenate([turn.T @ centripetal, np.zeros(3, np.longdouble)])


def _turn(scene: Scene, q: Array, i: int, ball: bool) -> Long:
    """Rotation from the axes of body i to those of its inboard neighbour."""
    if ball:
        w, x, y, z = _long(q[4 * i : 4 * i + 4])
        cross = _tilde(_long([x, y, z]))
        square = w * w + x * x + y * y + z * z
        relative = np.eye(3, dtype=np.longdouble) + 2 * (w * cross + cross @ cross) / square
    else:
        relative = _about(2, q[i])
    if i == 0:
        roll, pitch, yaw = scene["hinge"][0]["orientation"]
        return _about(2, yaw) @ _about(1, pitch) @ _about(0, roll) @ relative
    end = scene["body"][i - 1]["ends"]["tip"]
    return _about(0, end["orientation"][0]) @ relative


def _about(axis: int, angle: float) -> Long:
    c, s = np.cos(np.longdouble(angle)), np.sin(np.longdouble(angle))
    out = np.eye(3, dtype=np.longdouble)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    out[j, j] = out[k, k] = c
    out[j, k], out[k, j] = -s, s
    return out


def _body(body: dict[str, Any], omega: Long) -> tuple[Long, Long]:
    """Mass matrix and load of a body about its input end, body axes."""
    mass, center = np.longdouble(body["mass"]), _long(body["center_of_mass"])
    arm = _tilde(center)
    matrix = np.zeros((6, 6), np.longdouble)
    matrix[:3, :3] = mass * np.eye(3)
    matrix[3:, :3], matrix[:3, 3:] = mass * arm, -mass * arm
    inertia = np.diag(_long(body["inertia"])) - mass * (arm @ arm)
    matrix[3:, 3:] = inertia
    load = np.concatenate(
        [mass * np.cross(omega, np.cross(omega, center)), np.cross(omega, inertia @ omega)]
    )
    return matrix, load


def _tilde(a: Long) -> Long:
    x, y, z = a
    return _long([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def _twist_rotation(turn: Long) -> Long:
    out = np.zeros((6, 6), np.longdouble)
    out[:3, :3] = out[3:, 3:] = turn
    return out


def _factor(matrix: Long) -> Long:
    """Lower triangle L of a symmetric positive definite matrix, L L^T (Cholesky)."""
    size = len(matrix)
    L = np.zeros((size, size), np.longdouble)
    for j in range(size):
        L[j, j] = np.sqrt(matrix[j, j] - L[j, :j] @ L[j, :j])
        for i in range(j + 1, size):
            L[i, j] = (matrix[i, j] - L[i, :j] @ L[j, :j]) / L[j, j]
    return L


def _forward(L: Long, right: Long) -> Long:
    """L^-1 times columns."""
    out = np.array(right)
    for i in range(len(L)):
        out[i] = (out[i] - L[i, :i] @ out[:i]) / L[i, i]
    return out


def _backward(L: Long, right: Long) -> Long:
    """L^-T times a column."""
    out = np.array(right)
    for i in reversed(range(len(L))):
        out[i] = (out[i] - L[i + 1 :, i] @ out[i + 1 :]) / L[i, i]
    return out
