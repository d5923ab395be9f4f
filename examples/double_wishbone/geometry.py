"""A corner of a car by itself: places of all its points, and Lagrange's equations of point masses.

Nothing of mstmm is used but the numbers of the scene.  Two coordinates, the heave of the car and
the angle of the lower wishbone, and the places of rack and road give everything else by circles
and spheres; six points on the axes of a body carry its mass and its moments.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

SCENE = tomllib.loads(Path(__file__).with_name("scene.toml").read_text(encoding="utf-8"))
BODY: dict[str, dict[str, Any]] = {one["name"]: one for one in SCENE["body"]}
LAW: dict[str, dict[str, float]] = {one["name"]: one["law"] for one in SCENE["spring"]}
MOVING = ("lower", "upper", "upright", "tie")
GRAVITY, TIE = 9.81, 0.35
Array = NDArray[Any]


def end(name: str, which: str) -> Array:
    """An end of a body, in its own axes."""
    return np.array(BODY[name]["ends"][which], dtype=float)


def about_x(angle: Any) -> Array:
    """A rotation about x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def meeting(centers: list[Array], radii: list[float], side: float) -> Array:
    """The point at three distances from three others, on one of the two sides of their plane."""
    a, b, c = centers
    ex = (b - a) / np.sqrt((b - a) @ (b - a))
    along = ex @ (c - a)
    ey = c - a - along * ex
    ey = ey / np.sqrt(ey @ ey)
    x = (radii[0] ** 2 - radii[1] ** 2 + (b - a) @ (b - a)) / (2 * (ex @ (b - a)))
    y = (radii[0] ** 2 - radii[2] ** 2 + (c - a) @ (c - a) - 2 * along * x) / (2 * (ey @ (c - a)))
    z = side * np.sqrt(radii[0] ** 2 - x**2 - y**2)
    return np.asarray(a + x * ex + y * ey + z * np.cross(ex, ey))


def length(vector: Array) -> float:
    """Of a real vector."""
    return float(np.sqrt(vector @ vector))


def axes(points: list[Array]) -> Array:
    """Axes that three points of a body define, as columns."""
    x = points[1] - points[0]
    x = x / np.sqrt(x @ x)
    z = np.cross(x, points[2] - points[0])
    z = z / np.sqrt(z @ z)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def frames(heave: Any, angle: Any, rack: Any) -> dict[str, tuple[Array, Array]]:
    """Origin and axes of the bodies that the car carries."""
    car = heave * np.array([0, 0, 1])
    lower = car + end("car", "lower"), about_x(angle)
    foot = lower[0] + lower[1] @ end("lower", "ball")
    # The upper ball: on a circle about the axis of its wishbone, at a distance from the lower one.
    pivot, reach = car + end("car", "upper"), end("upper", "ball")
    height = length(end("upright", "top"))
    along = pivot[0] + reach[0] - foot[0]
    flat = (foot - pivot)[1:]
    apart2 = flat @ flat
    near = (reach[1:] @ reach[1:] - (height**2 - along**2) + apart2) / (2 * apart2)
    off = np.sqrt(reach[1:] @ reach[1:] / apart2 - near**2)
    place = near * flat + off * np.array([-flat[1], flat[0]])
    turn = np.arctan(place[1] / place[0]) - np.arctan(reach[2] / reach[1])
    upper = pivot, about_x(turn)
    top = pivot + upper[1] @ reach
    inner = car + end("car", "rack") + end("rack", "joint") + rack * np.array([0, 1, 0])
    arm_end, top_end = end("upright", "arm"), end("upright", "top")
    arm = meeting([foot, top, inner], [length(arm_end), length(arm_end - top_end), TIE], 1.0)
    own = axes([np.zeros(3), top_end, arm_end])
    upright = foot, axes([foot, top, arm]) @ own.T
    y = (arm - inner) / TIE
    x = np.cross(y, [0, 0, 1])
    x = x / np.sqrt(x @ x)
    return {"lower": lower, "upper": upper, "upright": upright,
            "tie": (inner, np.stack([x, y, np.cross(x, y)], axis=-1))}  # fmt: skip


def masses(name: str) -> tuple[Array, Array]:
    """Six equal masses and their places in the body (6, 3), of its mass, centre and moments."""
    body = BODY[name]
    moments = np.array([TIE**2 * body["mass"] / 12 if isinstance(x, str) else x
                        for x in body["inertia"]])  # fmt: skip
    spread = np.sqrt(np.maximum(3 * (moments.sum() / 2 - moments) / body["mass"], 0.0))
    arms = np.concatenate([np.diag(spread), -np.diag(spread)])
    return np.full(6, body["mass"] / 6), np.array(body["center_of_mass"]) + arms


PARTS = {name: masses(name) for name in MOVING}
CAR = BODY["car"]["mass"] + BODY["rack"]["mass"]
WEIGHTS = np.concatenate([[CAR], *(mass for mass, _ in PARTS.values())])


def places(x: Array) -> tuple[Array, Array]:
    """All mass points (n, 3) and the vectors along strut and tyre (2, 3) at heave, angle, rack,
    road."""
    heave, angle, rack, road = x
    found = frames(heave, angle, rack)
    points = [heave * np.array([[0, 0, 1]])]
    points += [found[name][0] + own @ found[name][1].T for name, (_, own) in PARTS.items()]
    (low, lower), (foot, upright) = found["lower"], found["upright"]
    patch = np.array([0, 0.77, 0]) + road * np.array([0, 0, 1])
    strut = low + lower @ end("lower", "seat") - end("car", "dome") - heave * np.array([0, 0, 1])
    tyre = foot + upright @ end("upright", "hub") - patch
    return np.concatenate(points), np.array([strut, tyre])


def along(x: Array, direction: Array) -> tuple[Array, Array]:
    """Derivatives of `places` along a direction, by a complex step."""
    found = places(x + 1e-30j * direction)
    return found[0].imag * 1e30, found[1].imag * 1e30


def accelerations(x: Array, v: Array, given: Array) -> Array:
    """Of heave and angle (2,), by Lagrange's equations; `given` those of rack and road."""
    columns = [along(x, unit) for unit in np.eye(4)]
    jacobian = np.stack([one[0] for one in columns], axis=-1)
    h = 1e-4
    bend = (along(x + h * v, v)[0] - along(x - h * v, v)[0]) / (2 * h)
    loads = -GRAVITY * WEIGHTS[:, None] * np.array([0, 0, 1])
    bend = bend + jacobian[..., 2:] @ given
    right = np.einsum("nik,ni->k", jacobian[..., :2], loads - WEIGHTS[:, None] * bend)
    mass = np.einsum("nik,n,nil->kl", jacobian[..., :2], WEIGHTS, jacobian[..., :2])
    vectors, rates = places(x)[1], along(x, v)[1]
    for k, name in enumerate(("strut", "tyre")):
        long = length(vectors[k])
        law, speed = LAW[name], vectors[k] @ rates[k] / long
        force = -law["stiffness"] * (long - law["rest"]) - law["damping"] * speed
        right += [force * (vectors[k] @ one[1][k]) / long for one in columns[:2]]
    return np.linalg.solve(mass, right)
