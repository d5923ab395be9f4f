"""The same physics described otherwise: rotated scenes, other axes and ends, split bodies.

Each takes a scene dictionary with its state and gives a new one; the given one is left alone.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np

from tests.reference.algebra import orientation, tilde, to_quaternion
from tests.reference.jets import Array
from tests.reference.tree import read

Scene = dict[str, Any]

#: Places of the six inertia numbers of a body.
_SIX = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def _quaternion(rotation: Array) -> list[float]:
    return [float(v) for v in to_quaternion(rotation)]


def _numbers(values: Any) -> list[float]:
    return [float(v) for v in np.asarray(values)]


def rotate_scene(scene: Scene, turn: Array, shift: Array) -> Scene:
    """Everything that refers to inertial axes turned by `turn`; the ground's points moved too."""
    out = copy.deepcopy(scene)
    out["gravity"] = _numbers(turn @ np.array(scene["gravity"]))
    for hinge in out["hinge"]:
        if hinge["inboard"] == "ground":
            hinge["orientation"] = _quaternion(turn @ orientation(hinge.get("orientation")))
            place = np.array(hinge.get("position", (0.0, 0, 0)))
            hinge["position"] = _numbers(turn @ place + shift)
    for load in out.get("load", []):
        if load.get("axes", "inertial") == "inertial":
            for key in ("force", "moment"):
                load[key] = _turned_texts(turn, load[key])
    for spring in out.get("spring", []):
        if spring["from"] == "ground":
            spring["position"] = _numbers(turn @ np.array(spring["position"]) + shift)
    return out


def _turned_texts(turn: Array, entries: list[Any]) -> list[str]:
    """Rows of turn @ entries where entries may be expressions."""
    return [
        " + ".join(f"({float(c)!r})*({e})" for c, e in zip(row, entries, strict=True))
        for row in turn
    ]


def change_body_axes(scene: Scene, rng: np.random.Generator) -> Scene:
    """Body axes turned and moved at random; every end stays where it is in the body.

    A hinge that held a body by its origin holds it by an end "origin" then.
    """
    out = copy.deepcopy(scene)
    names = {body["name"] for body in out["body"]}
    for body in out["body"]:
        shift, turn = rng.uniform(-1, 1, 3), orientation(rng.uniform(-3, 3, 3))
        tree_body = next(b for b in read(scene).bodies if b.name == body["name"])
        ends = {"origin": (np.zeros(3), np.eye(3)), **tree_body.ends}
        body["center_of_mass"] = _numbers(turn @ (tree_body.center - shift))
        tensor = turn @ tree_body.inertia @ turn.T
        body["inertia"] = [float(tensor[i]) for i in _SIX]
        body["ends"] = {
            name: {
                "position": _numbers(turn @ (place - shift)),
                "orientation": _quaternion(turn @ rotation),
            }
            for name, (place, rotation) in ends.items()
        }
    for entry in [*out["hinge"], *out.get("load", []), *out.get("spring", [])]:
        for key in ("inboard", "outboard", "on", "from", "to"):
            if entry.get(key) in names:
                entry[key] = f"{entry[key]}.origin"
    return out


def split(scene: Scene, name: str, part: float, rng: np.random.Generator) -> Scene:
    """A body cut in two of masses `part` and 1 - `part`, welded at a skew end.

    The inboard half keeps the name, the ends and the origin; the other half, "half", hangs on a
    new end "cut" by a fixed hinge and has axes of its own.  Together they have the same mass,
    mass centre and inertia.
    """
    out = copy.deepcopy(scene)
    whole = next(b for b in read(scene).bodies if b.name == name)
    body = next(b for b in out["body"] if b["name"] == name)
    # Apart as far as leaves a mass distribution: int x x^T dm stays positive definite.
    spread = np.trace(whole.inertia) / 2 * np.eye(3) - whole.inertia
    towards = rng.normal(size=3)
    towards *= 0.6 / np.linalg.norm(towards)
    apart = np.linalg.cholesky(spread) @ towards / np.sqrt(part * (1 - part) * whole.mass)
    centers = whole.center + (1 - part) * apart, whole.center - part * apart
    masses = part * whole.mass, (1 - part) * whole.mass
    rest = whole.inertia.copy()
    for mass, center in zip(masses, centers, strict=True):
        arm = tilde(center - whole.center)
        rest += mass * (arm @ arm)
    cut, turn = rng.uniform(-0.5, 0.5, 3), orientation(rng.uniform(-3, 3, 3))
    own, held = rng.uniform(-0.5, 0.5, 3), orientation(rng.uniform(-3, 3, 3))
    body |= {"mass": masses[0], "center_of_mass": _numbers(centers[0])}
    body["inertia"] = [float(part * rest[i]) for i in _SIX]
    cut_end = {"position": _numbers(cut), "orientation": _quaternion(turn)}
    body["ends"] = {**body.get("ends", {}), "cut": cut_end}
    # Axes of the whole -> axes of the half: they agree at the weld, turn = into^T held, with the
    # weld's own orientation between them.
    weld = orientation(rng.uniform(-3, 3, 3))
    into = held @ (turn @ weld).T
    tensor = into @ ((1 - part) * rest) @ into.T
    out["body"].append(
        {
            "name": "half",
            "mass": masses[1],
            "center_of_mass": _numbers(own + into @ (centers[1] - cut)),
            "inertia": [float(tensor[i]) for i in _SIX],
            "ends": {"weld": {"position": _numbers(own), "orientation": _quaternion(held)}},
        }
    )
    out["hinge"].append(
        {
            "name": "weld", "type": "fixed", "inboard": f"{name}.cut", "outboard": "half.weld",
            "orientation": _quaternion(weld),
        }
    )  # fmt: skip
    return out


def permute_bodies(scene: Scene, rng: np.random.Generator) -> Scene:
    """Bodies in another order: another order of the sweep, the same q and u."""
    out = copy.deepcopy(scene)
    out["body"] = [out["body"][i] for i in rng.permutation(len(out["body"]))]
    return out


def reorder_hinges(scene: Scene, rng: np.random.Generator) -> tuple[Scene, list[int], list[int]]:
    """Hinges in another order, and where the new q and u stand in the old ones."""
    out, tree = copy.deepcopy(scene), read(scene)
    order = rng.permutation(len(scene["hinge"]))
    out["hinge"] = [out["hinge"][i] for i in order]
    places = [tree.hinges[i] for i in order]
    q = [k for hinge in places for k in range(hinge.q.start, hinge.q.stop)]
    u = [k for hinge in places for k in range(hinge.u.start, hinge.u.stop)]
    return out, q, u


def heavier(scene: Scene, factor: float) -> Scene:
    """Masses, inertias, loads and laws all times `factor`: the same motion."""
    out = copy.deepcopy(scene)
    exact = "({}/{})".format(*factor.as_integer_ratio())  # decimals are rounded powers of two
    for body in out["body"]:
        body["mass"] *= factor
        body["inertia"] = [factor * value for value in body["inertia"]]
    for hinge in out["hinge"]:
        law = hinge.get("law", {})
        for key in ("stiffness", "damping", "inertia"):
            if key in law:
                law[key] = [factor * value for value in law[key]]
        if "effort" in law:
            law["effort"] = [f"{exact}*({text})" for text in law["effort"]]
        scaled = {"limits": ("stiffness", "damping"), "friction": ("coulomb", "static")}
        for name, keys in scaled.items():
            if name in law:
                law[name] = [e | {key: factor * e[key] for key in keys} for e in law[name]]
    for load in out.get("load", []):
        for key in ("force", "moment"):
            load[key] = [f"{exact}*({text})" for text in load[key]]
    for spring in out.get("spring", []):
        spring["law"] |= {key: factor * spring["law"][key] for key in ("stiffness", "damping")}
    return out
