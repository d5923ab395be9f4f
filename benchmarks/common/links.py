"""A scene dictionary as links: one body and the hinge that carries it, for the peers' builders."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

#: Coordinates and speeds of the hinge types that the benchmarks use.
COORDINATES = {"pin": (1, 1), "ball": (4, 3), "free": (7, 6)}


@dataclass(frozen=True)
class Link:
    """Body axes start at the hinge.  `place` (m) and `turn` (body axes at q = 0 to the carrier's
    axes) are seen from the carrier; `inertia` is 3 x 3 about the mass centre; `armature` is the
    inertia of a drive seen at the coordinate."""

    name: str
    parent: int
    kind: str
    axis: np.ndarray
    place: np.ndarray
    turn: np.ndarray
    mass: float
    center: np.ndarray
    inertia: np.ndarray
    armature: float


@dataclass(frozen=True)
class Tree:
    """Links from the root outwards, in the order of the scene's hinges."""

    links: tuple[Link, ...]
    gravity: np.ndarray

    @property
    def nq(self) -> int:
        return sum(COORDINATES[link.kind][0] for link in self.links)

    @property
    def nu(self) -> int:
        return sum(COORDINATES[link.kind][1] for link in self.links)


def rotation(vector: Any) -> np.ndarray:
    """Rotation matrix of a rotation vector or of w, x, y, z; quarter turns without rounding."""
    if not any(vector):
        return np.eye(3)
    if len(vector) == 4:
        matrix = Rotation.from_quat(np.roll(vector, -1)).as_matrix()
    else:
        matrix = Rotation.from_rotvec(vector).as_matrix()
    whole = np.round(matrix)
    return whole if np.abs(matrix - whole).max() < 1e-12 else matrix


def tensor(values: list[float]) -> np.ndarray:
    """3 x 3 from xx, yy, zz[, xy, xz, yz]."""
    xx, yy, zz, xy, xz, yz = [*values, 0.0, 0.0, 0.0][:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def end_of(body: dict[str, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Place and axes of an output end."""
    end = body["ends"][name]
    if isinstance(end, dict):
        return np.array(end["position"], float), rotation(end.get("orientation", [0, 0, 0]))
    return np.array(end, float), np.eye(3)


def links_of(scene: dict[str, Any]) -> Tree:
    """Links of a scene whose bodies are hung up at their origins; hinges sorted from the root."""
    bodies = {body["name"]: body for body in scene["body"]}
    number = {"ground": -1}
    links: list[Link] = []
    for hinge in scene["hinge"]:
        carrier, _, end = hinge["inboard"].partition(".")
        place, axes = end_of(bodies[carrier], end) if end else (
            np.array(hinge.get("position", [0.0, 0.0, 0.0]), float), np.eye(3)
        )  # fmt: skip
        body = bodies[hinge["outboard"]]
        number[body["name"]] = len(links)
        links.append(
            Link(
                name=hinge["name"],
                parent=number[carrier],
                kind=hinge["type"],
                axis=np.array(hinge.get("axis", [0.0, 0.0, 1.0]), float),
                place=place,
                turn=axes @ rotation(hinge.get("orientation", [0.0, 0.0, 0.0])),
                mass=float(body["mass"]),
                center=np.array(body["center_of_mass"], float),
                inertia=tensor(body["inertia"]),
                armature=float(hinge.get("law", {}).get("inertia", 0.0)),
            )
        )
    return Tree(tuple(links), np.array(scene["gravity"], float))


def states(tree: Tree, count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Random q (count, nq) and u (count, nu): angles and speeds in -1..1, unit quaternions."""
    rng = np.random.default_rng(seed)
    q, u = rng.uniform(-1, 1, (count, tree.nq)), rng.uniform(-1, 1, (count, tree.nu))
    at = 0
    for link in tree.links:
        size = COORDINATES[link.kind][0]
        if size >= 4:
            turn = q[:, at + size - 4 : at + size]
            turn[:, 0] += 2.0
            turn /= np.linalg.norm(turn, axis=1, keepdims=True)
        at += size
    return q, u
