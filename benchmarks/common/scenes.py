"""Scenes of the benchmarks as scene dictionaries."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

Scene = dict[str, Any]
EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
AXES = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0])


def rod(name: str) -> dict[str, Any]:
    """A uniform rod of 1 m and 1 kg along x, 0.1 m thick."""
    return {
        "name": name,
        "mass": 1.0,
        "center_of_mass": [0.5, 0.0, 0.0],
        "inertia": [1 / 1200, 1 / 12, 1 / 12],
        "ends": {"tip": [1.0, 0.0, 0.0]},
    }


def chain(n: int, gravity: list[float], hinge: Callable[[int], dict[str, Any]]) -> Scene:
    """n rods in a row, hinge(i) inboard of rod i."""
    hinges = [
        {
            "name": f"hinge{i}",
            "inboard": f"rod{i - 1}.tip" if i else "ground",
            "outboard": f"rod{i}",
            **hinge(i),
        }
        for i in range(n)
    ]
    bodies = [rod(f"rod{i}") for i in range(n)]
    return {"schema_version": 1, "gravity": gravity, "body": bodies, "hinge": hinges}


def pins(n: int) -> Scene:
    """Axes alternate x, y, z."""
    return chain(n, [0.0, 0.0, -9.81], lambda i: {"type": "pin", "axis": AXES[i % 3]})


def balls(n: int) -> Scene:
    """Ball hinges."""
    return chain(n, [0.0, 0.0, -9.81], lambda i: {"type": "ball"})


def planar(n: int) -> Scene:
    """All axes along z, gravity in the plane."""
    return chain(n, [0.0, -9.81, 0.0], lambda i: {"type": "pin", "axis": AXES[2]})


def example(name: str) -> Scene:
    """One of the scenes under examples/."""
    return tomllib.loads(next((EXAMPLES / name).glob("*.toml")).read_text())


def puma(n: int = 6) -> Scene:
    """The Puma 560 of examples/."""
    return example("puma560")


def arm(n: int) -> Scene:
    """Robot-like arm: links with offsets and full inertias, axes along and across."""
    scene = chain(n, [0.0, 0.0, -9.81], lambda i: {"type": "pin", "axis": AXES[2 - i % 2]})
    for i, body in enumerate(scene["body"]):
        body |= {
            "mass": 4.0 / (1 + i / 4),
            "center_of_mass": [0.01, 0.02, 0.12],
            "inertia": [0.03, 0.025, 0.01, 0.001, -0.002, 0.0015],
            "ends": {"tip": [0.0, 0.03 * (i % 2), 0.25]},
        }
    return scene


def long_chain(kind: str, n: int) -> Scene:
    """`pins`, `balls` or `planar` with any n, written as one chain."""
    body = {key: value for key, value in rod("").items() if key != "name"}
    kinds: dict[str, Any] = {
        "pins": [{"type": "pin", "axis": axis} for axis in AXES],
        "balls": {"type": "ball"},
        "planar": {"type": "pin", "axis": AXES[2]},
    }
    chain_table = {
        "name": "rods",
        "count": n,
        "inboard": "ground",
        "body": body,
        "hinge": kinds[kind],
    }
    gravity = [0.0, -9.81, 0.0] if kind == "planar" else [0.0, 0.0, -9.81]
    return {"schema_version": 1, "gravity": gravity, "chain": [chain_table]}


def hanging_chain(scene: Scene, q: list[list[float]], u: list[list[float]]) -> Scene:
    """Chain along x under gravity along x, with an initial state."""
    scene["gravity"] = [9.81, 0.0, 0.0]
    for hinge, angle, speed in zip(scene["hinge"], q, u, strict=True):
        hinge["initial"] = {"q": angle, "u": speed}
    return scene


def swinging_arm() -> Scene:
    """Three rods on pins (x, y, z), released at up to 40 degrees: not chaotic within 10 s."""
    return hanging_chain(pins(3), [[0.35], [0.7], [0.56]], [[1.4], [0.0], [0.0]])


def swinging_balls() -> Scene:
    """Three rods on balls, turned by up to 40 degrees and spinning."""
    rotations = ((0.0, 0.7, 0.0), (0.0, 0.35, 0.35), (0.0, 0.0, 0.49))
    quaternions = []
    for rotation_vector in rotations:
        angle = math.hypot(*rotation_vector)
        quaternions.append(
            [math.cos(angle / 2), *(math.sin(angle / 2) * x / angle for x in rotation_vector)]
        )
    return hanging_chain(
        balls(3), quaternions, [[0.35, 0.0, 0.7], [0.0, -0.35, 0.0], [0.0, 0.0, 0.7]]
    )


#: name, inboard body, position on it (m), axis, mass (kg), mass centre (m), inertia (kg m2).
LEG = (
    ("hip_yaw", "pelvis", (0.0, 0.09, -0.06), 2, 2.1, (0.012, 0.004, -0.055),
     (0.0082, 0.0079, 0.0031, 0.0001, -0.0004, 0.0002)),
    ("hip_roll", "hip_yaw", (0.02, 0.0, -0.11), 0, 1.6, (-0.008, 0.011, -0.014),
     (0.0026, 0.0031, 0.0029, 0.0001, 0.0002, -0.0001)),
    ("hip_pitch", "hip_roll", (0.0, 0.035, 0.0), 1, 5.4, (0.009, 0.012, -0.162),
     (0.0740, 0.0722, 0.0101, -0.0005, 0.0042, 0.0021)),
    ("knee", "hip_pitch", (-0.012, 0.0, -0.34), 1, 3.0, (0.011, 0.003, -0.141),
     (0.0311, 0.0306, 0.0042, 0.0001, 0.0013, -0.0007)),
    ("ankle_pitch", "knee", (0.0, 0.0, -0.33), 1, 0.25, (-0.004, 0.0, 0.006),
     (0.00019, 0.00024, 0.00013, 0.0, 0.00001, 0.0)),
    ("ankle_roll", "ankle_pitch", (0.0, 0.0, -0.018), 0, 0.9, (0.031, 0.0, -0.022),
     (0.0007, 0.0031, 0.0034, 0.0, 0.0002, 0.0)),
)  # fmt: skip
ARM = (
    ("shoulder_pitch", "chest", (0.004, 0.12, 0.26), 1, 1.1, (0.001, 0.043, -0.006),
     (0.0013, 0.0010, 0.0012, 0.0001, 0.0, 0.0002)),
    ("shoulder_roll", "shoulder_pitch", (0.0, 0.055, -0.012), 0, 1.3, (0.006, 0.007, -0.065),
     (0.0043, 0.0042, 0.0012, 0.0, 0.0003, -0.0002)),
    ("shoulder_yaw", "shoulder_roll", (0.0, 0.006, -0.14), 2, 1.0, (0.009, 0.001, -0.072),
     (0.0033, 0.0034, 0.0009, 0.0, 0.0004, 0.0001)),
    ("elbow", "shoulder_yaw", (0.016, 0.0, -0.10), 1, 1.2, (0.101, 0.004, -0.011),
     (0.0012, 0.0078, 0.0076, -0.0003, 0.0006, 0.0001)),
)  # fmt: skip
TRUNK = (
    ("waist_yaw", "pelvis", (-0.004, 0.0, 0.05), 2, 0.6, (0.003, 0.0, 0.018),
     (0.0008, 0.0009, 0.0006, 0.0, 0.0001, 0.0)),
    ("waist_roll", "waist_yaw", (0.0, 0.0, 0.04), 0, 0.5, (0.002, 0.001, 0.009),
     (0.0005, 0.0005, 0.0004, 0.0, 0.0, 0.0)),
    ("chest", "waist_roll", (0.0, 0.0, 0.02), 1, 9.8, (0.006, 0.001, 0.154),
     (0.1270, 0.1050, 0.0460, 0.0004, -0.0031, 0.0011)),
    ("neck", "chest", (0.002, 0.0, 0.39), 2, 3.4, (0.021, 0.0, 0.081),
     (0.0180, 0.0205, 0.0098, 0.0, 0.0011, 0.0)),
)  # fmt: skip
PELVIS = (6.2, (-0.004, 0.001, 0.012), (0.0410, 0.0290, 0.0390, 0.0001, -0.0008, 0.0002))


def mirror_limb(limb: tuple[Any, ...], names: set[str]) -> tuple[Any, ...]:
    """Right limb from the left one by a reflection of y."""
    name, left_parent, (x, y, z), axis, mass, (cx, cy, cz), (xx, yy, zz, xy, xz, yz) = limb
    parent = f"right_{left_parent}" if left_parent in names else left_parent
    center, inertia = (cx, -cy, cz), (xx, yy, zz, -xy, xz, -yz)
    return (f"right_{name}", parent, (x, -y, z), axis, mass, center, inertia)


def humanoid(n: int = 25) -> Scene:
    """Tree of the size of a humanoid robot: a free pelvis and 24 pins; invented data."""
    limbs = LEG + ARM
    names = {limb[0] for limb in limbs}
    parts = (*TRUNK, *limbs, *(mirror_limb(limb, names) for limb in limbs))
    mass, center, inertia = PELVIS
    bodies: list[dict[str, Any]] = [
        {"name": "pelvis", "mass": mass, "center_of_mass": list(center), "inertia": list(inertia)}
    ]
    hinges: list[dict[str, Any]] = [
        {"name": "root", "type": "free", "inboard": "ground", "outboard": "pelvis"}
    ]
    ends: dict[str, dict[str, list[float]]] = {}
    for name, parent, position, axis, mass, center, inertia in parts:
        ends.setdefault(parent, {})[name] = list(position)
        bodies.append(
            {"name": name, "mass": mass, "center_of_mass": list(center), "inertia": list(inertia)}
        )
        hinges.append(
            {"name": f"{name}_joint", "type": "pin", "inboard": f"{parent}.{name}",
             "outboard": name, "axis": AXES[axis]}
        )  # fmt: skip
    for body in bodies:
        body["ends"] = ends.get(body["name"], {})
    return {"schema_version": 1, "gravity": [0.0, 0.0, -9.81], "body": bodies, "hinge": hinges}


#: Kind -> scene of n bodies (Puma and humanoid have one size each).
KINDS: dict[str, Callable[[int], Scene]] = {
    "pins": pins, "balls": balls, "planar": planar, "puma": puma, "humanoid": humanoid,
}  # fmt: skip
SIZES = {"puma": 6, "humanoid": 25}
