"""Random chains and trees of rigid and flexible bodies, each drawn from a seed.

Beams have polynomial shapes of their own, so that every quadrature of the reference is exact.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.reference import random_scenes as rigid
from tests.reference.jets import Array
from tests.reference.tree import SIZES

from .beam import text_of
from .dense import mass_matrix, system

Scene = dict[str, Any]
Generator = np.random.Generator

SPATIAL = ("fixed", "pin", "prismatic", "ball", "universal", "free", "elastic")
PLANAR = ("fixed", "pin", "prismatic", "planar")


def random_beam(rng: Generator, name: str, planar: bool = False, stiffening: bool = True) -> Scene:
    """A beam with one or two shapes in each direction and a frame drawn among all."""
    length = float(rng.uniform(0.5, 2.0))
    mass = float(10 ** rng.uniform(-0.5, 0.7))

    def shapes(count: int, first: int) -> list[str]:
        texts = []
        for k in range(first, first + count):
            a, b = rng.uniform(0.3, 1.0, 2)
            texts.append(text_of({k: a * length ** (1.0 - k), k + 1: -b * length**-k}))
        return texts

    own: dict[str, list[str]] = {"y": shapes(2, 2)}
    beam: Scene = {
        "name": name,
        "length": length,
        "mass_per_length": mass,
        "bending_stiffness": [float(v) for v in rng.uniform(5, 50, 2)],
        "stiffening": stiffening,
        "quadrature": False,
        "frame": str(rng.choice(["tangent", "tangent@mid", "tangent@tip", "chord", "mean"])),
        "ends": {
            "mid": 0.4 * length,
            "skew": {"position": 0.7 * length, "orientation": _attitude(rng, planar)},
        },
        "damping": {"stiffness": 0.01},
        "viscous_drag": float(rng.choice([0.0, 0.4])),
    }
    if rng.random() < 0.5 and not planar:
        beam["rotary_inertia"] = [float(v) for v in rng.uniform(0.01, 0.05, 2) * mass]
    else:
        beam["polar_inertia_per_length"] = float(rng.uniform(0.01, 0.05) * mass)
    if not planar:
        own["z"] = shapes(1, 2)
        own["twist"], own["axial"] = shapes(1, 1), shapes(1, 1)
        beam["torsional_stiffness"], beam["axial_stiffness"] = 8.0, 300.0
    beam["shapes"] = own
    beam["modes"] = {word: len(texts) for word, texts in own.items()}
    return beam


def _attitude(rng: Generator, planar: bool) -> list[float]:
    if planar:
        return [0.0, 0.0, float(rng.uniform(-3, 3))]
    return [float(v) for v in rng.uniform(-3, 3, 3)]


def random_system(
    seed: int, planar: bool = False, most: int = 5, chain: bool = False, stiffening: bool = True
) -> Scene:
    """Scene with at least one beam; every end may hold or be held."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, most + 1))
    flexible = rng.random(count) < 0.6
    flexible[rng.integers(count)] = True
    bodies, beams, hinges = [], [], []
    for i in range(count):
        name = f"body{i}"
        if flexible[i]:
            beams.append(random_beam(rng, name, planar, stiffening))
            held = str(rng.choice([".root", ".mid", ".skew", ".tip"]))
        else:
            bodies.append(_random_rigid_body(rng, name, planar))
            held = str(rng.choice(["", ".skew"]))
        inboard = "ground"
        if i:
            parent = i - 1 if chain else int(rng.integers(0, i))
            choice = (".tip", ".mid", ".skew") if flexible[parent] else (".plain", ".turned")
            inboard = f"body{parent}{rng.choice(choice)}"
        kind = str(rng.choice(PLANAR if planar else SPATIAL))
        hinges.append(_hinge(rng, f"hinge{i}", kind, inboard, name + held, planar))
    loaded = beams[0]["name"] + ".tip"
    force, moment = rng.uniform(-5, 5, 3), rng.uniform(-2, 2, 3)
    if planar:
        force[2] = moment[0] = moment[1] = 0.0
    axes = {"axes": str(rng.choice(["inertial", "body"]))}
    gravity = rng.uniform(-10, 10, 3)
    if planar:
        gravity[2] = 0.0
    return {
        "schema_version": 1,
        "gravity": gravity.tolist(),
        "body": bodies,
        "beam": beams,
        "hinge": [hinges[i] for i in rng.permutation(count)],
        "load": [
            {"on": loaded, "force": force.tolist(), "moment": moment.tolist()} | axes,
            {
                "on": beams[-1]["name"],
                "force_per_length": force[::-1].tolist() if not planar else force.tolist(),
                "span": [0.2 * beams[-1]["length"], 0.7 * beams[-1]["length"]],
            }
            | axes,
        ],
    }


def _random_rigid_body(rng: Generator, name: str, planar: bool) -> Scene:
    body = rigid.random_body(rng, name)
    body["mass"] = float(rng.uniform(0.3, 3.0))
    body["inertia"] = rigid.random_inertia(rng, body["mass"])
    if planar:
        body["center_of_mass"][2] = 0.0
        body["inertia"][4:] = [0.0, 0.0]
        for end in ("plain", "lug"):
            body["ends"][end][2] = 0.0
        for end in ("turned", "skew"):
            place = [*body["ends"][end]["position"][:2], 0.0]
            body["ends"][end] = {"position": place, "orientation": _attitude(rng, True)}
    return body


def _hinge(
    rng: Generator, name: str, kind: str, inboard: str, outboard: str, planar: bool
) -> Scene:
    hinge = rigid.random_hinge(rng, name, kind, inboard, outboard)
    if kind == "free":
        hinge.pop("axis", None)
    if planar:
        hinge["orientation"] = _attitude(rng, True)
        if inboard == "ground":
            hinge["position"][2] = 0.0
        if kind == "prismatic":
            hinge["axis"] = [*hinge["axis"][:2], 0.0]
        elif kind == "pin":
            hinge["axis"] = [0.0, 0.0, 1.0]
        elif kind == "planar":
            hinge["axis"], hinge["axis2"] = [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]
    if kind in ("pin", "prismatic"):
        law = {"stiffness": 6.0, "rest": 0.2, "damping": 0.3}
        hinge["law"] = {key: [value] for key, value in law.items()}
    if kind == "elastic":
        hinge["law"] = {"stiffness": [20.0] * 6, "damping": [0.2] * 6}
    return hinge


def random_state(scene: Scene, seed: int, size: float = 0.05) -> tuple[Array, Array]:
    """Hinges within about a radian, modes within `size` (or less, where a mass matrix that is cut
    after the second order is not safely definite), rates of all within 1."""
    rng = np.random.default_rng(seed)
    q, u = [], []
    for hinge in scene["hinge"]:
        nq, nu = SIZES[hinge["type"]]
        own = rng.uniform(-1, 1, nq)
        if hinge["type"] in ("ball", "free", "elastic"):
            own[-4:] = rng.normal(size=4)
            own[-4:] /= np.linalg.norm(own[-4:])
        q.append(own)
        u.append(rng.uniform(-1, 1, nu))
    beams = {body.name: body for body in system(scene).bodies}
    for beam in scene["beam"]:
        body = beams[beam["name"]]
        eta = rng.uniform(-size, size, body.n)
        least = 0.3 * np.linalg.eigvalsh(mass_matrix(body, 0 * eta, True))[0]
        while np.linalg.eigvalsh(mass_matrix(body, eta, True))[0] < least:
            eta = eta / 2
        q.append(eta)
        u.append(rng.uniform(-1, 1, body.n))
    return np.concatenate(q), np.concatenate(u)
