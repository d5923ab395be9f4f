"""Scene dictionary as a tree of links, for the builders of other programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

#: Coordinates and speeds of the hinge types that the benchmarks use.
COORDINATES = {"pin": (1, 1), "ball": (4, 3), "free": (7, 6)}


@dataclass(frozen=True)
class Link:
    """A body and its inboard hinge, where the body axes start.

    `position` (m) and `orientation` (body axes at q = 0) are relative to the parent; `inertia`
    (3, 3) is about the mass centre; `armature` is the drive inertia at the coordinate."""

    name: str
    parent: int
    kind: str
    axis: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
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
    rounded = np.round(matrix)
    return rounded if np.abs(matrix - rounded).max() < 1e-12 else matrix


def tensor(values: list[float]) -> np.ndarray:
    """3 x 3 from xx, yy, zz[, xy, xz, yz]."""
    xx, yy, zz, xy, xz, yz = [*values, 0.0, 0.0, 0.0][:6]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def end_frame(body: dict[str, Any], name: str) -> tuple[np.ndarray, np.ndarray]:
    """Position and axes of an end of a body."""
    end = body["ends"][name]
    if isinstance(end, dict):
        return np.array(end["position"], float), rotation(end.get("orientation", [0, 0, 0]))
    return np.array(end, float), np.eye(3)


def link_tree(scene: dict[str, Any]) -> Tree:
    """Links of a scene whose bodies start at their inboard hinges, sorted from the root."""
    bodies = {body["name"]: body for body in scene["body"]}
    link_indices = {"ground": -1}
    links: list[Link] = []
    for hinge in scene["hinge"]:
        carrier, _, end = hinge["inboard"].partition(".")
        position, axes = end_frame(bodies[carrier], end) if end else (
            np.array(hinge.get("position", [0.0, 0.0, 0.0]), float), np.eye(3)
        )  # fmt: skip
        body = bodies[hinge["outboard"]]
        link_indices[body["name"]] = len(links)
        links.append(
            Link(
                name=hinge["name"],
                parent=link_indices[carrier],
                kind=hinge["type"],
                axis=np.array(hinge.get("axis", [0.0, 0.0, 1.0]), float),
                position=position,
                orientation=axes @ rotation(hinge.get("orientation", [0.0, 0.0, 0.0])),
                mass=float(body["mass"]),
                center=np.array(body["center_of_mass"], float),
                inertia=tensor(body["inertia"]),
                armature=float(hinge.get("law", {}).get("inertia", 0.0)),
            )
        )
    return Tree(tuple(links), np.array(scene["gravity"], float))


def random_states(tree: Tree, count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Random q (count, nq) and u (count, nu): angles and speeds in -1..1, unit quaternions."""
    rng = np.random.default_rng(seed)
    q, u = rng.uniform(-1, 1, (count, tree.nq)), rng.uniform(-1, 1, (count, tree.nu))
    offset = 0
    for link in tree.links:
        size = COORDINATES[link.kind][0]
        if size >= 4:
            quaternion = q[:, offset + size - 4 : offset + size]
            quaternion[:, 0] += 2.0
            quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
        offset += size
    return q, u
