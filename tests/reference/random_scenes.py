"""Random scenes and states, each drawn from a seed that its test prints.

Trees of 1 to `most` bodies with all hinge types mixed, masses over three decades, full physical
inertia, skew frames, bodies held by ends other than their origin, loads, laws and springs.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .jets import Array
from .tree import SIZES, Tree, read

Scene = dict[str, Any]
TYPES = tuple(SIZES)
Generator = np.random.Generator


def _vector(rng: Generator, size: float = 1.0) -> list[float]:
    return [float(v) for v in rng.uniform(-size, size, 3)]


def _quaternion(rng: Generator) -> list[float]:
    v = rng.normal(size=4)
    return [float(x) for x in v / np.linalg.norm(v)]


def random_inertia(rng: Generator, mass: float) -> list[float]:
    """[xx, yy, zz, xy, xz, yz] of a solid ellipsoid with axes 0.1 to 1 m in a random attitude."""
    a, b, c = rng.uniform(0.1, 1.0, 3) ** 2
    principal = mass / 5 * np.array([b + c, a + c, a + b])
    basis = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    tensor = basis @ np.diag(principal) @ basis.T
    return [float(tensor[i]) for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def random_body(rng: Generator, name: str) -> Scene:
    """Body of 0.03 to 30 kg with four output ends, two of them turned."""
    mass = float(10 ** rng.uniform(-1.5, 1.5))
    return {
        "name": name,
        "mass": mass,
        "center_of_mass": _vector(rng),
        "inertia": random_inertia(rng, mass),
        "ends": {
            "plain": _vector(rng),
            "turned": {"position": _vector(rng), "orientation": _vector(rng, 3.0)},
            "skew": {"position": _vector(rng), "orientation": _quaternion(rng)},
            "lug": _vector(rng),
        },
    }


def random_law(rng: Generator, kind: str) -> Scene:
    """Stiffness, rest, damping, friction, stops, effort and reflected inertia of every speed."""
    count = SIZES[kind][1]
    law: Scene = {}
    for key, low, high in (
        ("stiffness", 0.5, 20.0),
        ("rest", -0.3, 0.3),
        ("damping", 0.1, 2.0),
        ("inertia", 0.05, 0.5),
    ):
        if rng.random() < 0.6:
            law[key] = [float(v) for v in rng.uniform(low, high, count)]
    if kind == "ball":
        law.pop("rest", None)
    elif kind in ("free", "elastic"):
        law["rest"] = [*law.get("rest", [0.0] * 6)[:3], 0.0, 0.0, 0.0]
    elif rng.random() < 0.3:
        friction = {"coulomb": 0.3, "static": 0.5, "stribeck_velocity": 0.2}
        friction["regularisation_velocity"] = 0.1
        stops = {"lower": -0.4, "upper": 0.5, "stiffness": 30.0, "damping": 4.0}
        law["friction"], law["limits"] = [friction] * count, [stops] * count
    if rng.random() < 0.5:
        a, b = (float(v) for v in rng.uniform(-3, 3, 2))
        law["effort"] = [f"{a!r}*cos(2*t + {i}) + {b!r}*sin(u[{i}])^3" for i in range(count)]
    return law


def random_hinge(rng: Generator, name: str, kind: str, inboard: str, outboard: str) -> Scene:
    """Hinge of a given type between two ends, in skew frames."""
    hinge: Scene = {"name": name, "type": kind, "inboard": inboard, "outboard": outboard}
    if inboard == "ground":
        hinge["position"] = _vector(rng)
    hinge["orientation"] = _quaternion(rng) if rng.random() < 0.5 else _vector(rng, 3.0)
    if kind not in ("fixed", "gimbal"):  # the axis of a ball is that of its law's twist
        hinge["axis"] = _vector(rng)
    if kind in ("universal", "planar"):
        axis = np.array(hinge["axis"])
        hinge["axis2"] = [float(v) for v in np.cross(axis, rng.normal(size=3))]
    if kind == "screw":
        hinge["lead"] = float(rng.uniform(0.2, 2.0))
    return hinge


def _load(rng: Generator, bodies: list[Scene]) -> Scene:
    names = [b["name"] for b in bodies]
    on = str(rng.choice(names)) + str(rng.choice(["", ".plain", ".turned"]))
    load: Scene = {"on": on, "force": _vector(rng, 5.0), "moment": _vector(rng, 2.0)}
    load["force"][1] = f"{load['force'][1]!r}*sin(3*t + 0.5)"
    load["axes"] = str(rng.choice(["inertial", "body", str(rng.choice(names))]))
    return load


def _spring(rng: Generator, bodies: list[Scene]) -> Scene:
    ends = [f"{b['name']}.lug" for b in bodies]
    to = str(rng.choice(ends))
    body = to.partition(".")[0]
    others = ["ground"] + [e for e in ends if e.partition(".")[0] != body]
    law = {"stiffness": float(rng.uniform(5, 50)), "rest": 0.4, "damping": float(rng.uniform(0, 2))}
    spring: Scene = {"from": str(rng.choice(others)), "to": to, "law": law}
    if spring["from"] == "ground":
        spring["position"] = _vector(rng, 3.0)
    return spring


def random_scene(
    seed: int,
    most: int = 8,
    types: tuple[str, ...] = TYPES,
    laws: bool = True,
    loads: bool = True,
    chain: bool = False,
    roots: bool = True,
) -> Scene:
    """Scene dictionary drawn from `seed`; a chain instead of a tree if asked; several bodies may
    hang on ground unless `roots` is False."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, most + 1))
    bodies = [random_body(rng, f"body{i}") for i in range(count)]
    hinges = []
    for i in range(count):
        kind = str(rng.choice(types))
        held = str(rng.choice(["", ".skew"]))
        if i == 0 or (roots and not chain and rng.random() < 0.1):
            inboard = "ground"
        else:
            parent = i - 1 if chain else int(rng.integers(0, i))
            inboard = f"body{parent}.{rng.choice(['plain', 'turned'])}"
        hinge = random_hinge(rng, f"hinge{i}", kind, inboard, f"body{i}{held}")
        if laws and kind != "fixed" and rng.random() < 0.7:
            hinge["law"] = random_law(rng, kind)
        hinges.append(hinge)
    order = rng.permutation(count)
    scene: Scene = {
        "schema_version": 1,
        "gravity": _vector(rng, 10.0),
        "body": [bodies[i] for i in order],
        "hinge": [hinges[i] for i in rng.permutation(count)],
    }
    if loads:
        scene["load"] = [_load(rng, bodies) for _ in range(int(rng.integers(0, 3)))]
        scene["spring"] = [_spring(rng, bodies) for _ in range(int(rng.integers(0, 3)))]
    return scene


def random_state(scene: Scene | Tree, seed: int) -> tuple[Array, Array]:
    """Coordinates within about a radian (unit quaternions in any attitude) and speeds within 1."""
    tree, rng = read(scene), np.random.default_rng(seed)
    q, u = rng.uniform(-1, 1, tree.nq), rng.uniform(-1, 1, tree.nu)
    for hinge in tree.hinges:
        if hinge.type in ("ball", "free", "elastic"):
            q[hinge.q.stop - 4 : hinge.q.stop] = _quaternion(rng)
    return q, u


def aligned_chain(seed: int, types: tuple[str, ...], springs: bool = False) -> Scene:
    """Chain with axes along coordinate directions and whole-number frames, small enough for
    symbolic formulations; full inertia, laws with a spring and a damper if asked."""
    rng = np.random.default_rng(seed)
    bodies, hinges = [], []
    for i, kind in enumerate(types):
        body = random_body(rng, f"body{i}")
        body["ends"] = {"tip": [1.0, 0.0, 0.0]}
        bodies.append(body)
        first, second = rng.permutation(3)[:2]
        hinge: Scene = {"name": f"hinge{i}", "type": kind, "outboard": f"body{i}"}
        hinge["inboard"] = f"body{i - 1}.tip" if i else "ground"
        hinge["axis"] = [float(k == first) for k in range(3)]
        if kind in ("universal", "planar"):
            hinge["axis2"] = [float(k == second) for k in range(3)]
        if kind == "screw":
            hinge["lead"] = 0.5
        if springs:
            values = {"stiffness": 4.0, "rest": 0.25, "damping": 0.5}
            hinge["law"] = {key: [value] * SIZES[kind][1] for key, value in values.items()}
        hinges.append(hinge)
    return {"schema_version": 1, "gravity": [0, 0, -9.81], "body": bodies, "hinge": hinges}


def floating_tree(seed: int, most: int = 6) -> Scene:
    """Tree of pins, balls, universals and screws with laws but no loads on a free root, no gravity:
    its momentum is constant."""
    types = ("pin", "ball", "universal", "screw")
    scene = random_scene(seed, most, types=types, loads=False, roots=False)
    scene["gravity"] = [0.0, 0.0, 0.0]
    root = next(h for h in scene["hinge"] if h["inboard"] == "ground")
    root["type"] = "free"
    for key in ("law", "axis", "axis2", "lead"):
        root.pop(key, None)
    return scene
