"""A scene dictionary as arrays: bodies, hinges with their two frames, order from the root."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .algebra import orientation, triad, unit
from .jets import Array

#: Coordinates and speeds of each hinge type.
SIZES = {
    "fixed": (0, 0),
    "pin": (1, 1),
    "prismatic": (1, 1),
    "screw": (1, 1),
    "cylindrical": (2, 2),
    "universal": (2, 2),
    "ball": (4, 3),
    "planar": (3, 3),
    "free": (7, 6),
    "gimbal": (3, 3),
    "elastic": (7, 6),
}


@dataclass(frozen=True)
class Body:
    """Mass, mass centre and inertia about it in body axes; ends as (position, rotation)."""

    name: str
    mass: float
    center: Array
    inertia: Array
    ends: dict[str, tuple[Array, Array]]


@dataclass(frozen=True)
class Hinge:
    """`parent` -1 is ground; (ro, Ro) inboard hinge frame in parent axes, orientation included;
    (rp, Rp) outboard end in child axes."""

    name: str
    type: str
    parent: int
    child: int
    ro: Array
    Ro: Array
    rp: Array
    Rp: Array
    axis: Array
    axis2: Array
    pitch: float
    law: Mapping[str, Any]
    drive: tuple[Any, ...]
    q: slice
    u: slice
    initial: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Tree:
    """`order` lists hinge numbers from the root outwards, but for those that close loops."""

    bodies: tuple[Body, ...]
    hinges: tuple[Hinge, ...]
    order: tuple[int, ...]
    gravity: Array
    loads: tuple[Mapping[str, Any], ...]
    springs: tuple[Mapping[str, Any], ...]
    nq: int
    nu: int

    def body_number(self, name: str) -> int:
        """Position of a body in the scene."""
        return next(i for i, body in enumerate(self.bodies) if body.name == name)

    def end(self, where: str, position: Any = None) -> tuple[int, Array, Array]:
        """Body number, position and rotation of "ground", "body" or "body.end"."""
        if where == "ground":
            return -1, np.asarray(position or (0, 0, 0), float), np.eye(3)
        name, _, end = where.partition(".")
        number = self.body_number(name)
        if not end:
            return number, np.zeros(3), np.eye(3)
        return number, *self.bodies[number].ends[end]

    def initial(self) -> tuple[Array, Array]:
        """Start values of q and u, the reference pose at rest where nothing is given."""
        q, u = np.zeros(self.nq), np.zeros(self.nu)
        for hinge in self.hinges:
            if hinge.type in ("ball", "free", "elastic"):
                q[hinge.q.stop - 4] = 1.0
            if hinge.initial.get("q") is not None:
                q[hinge.q] = hinge.initial["q"]
            if hinge.initial.get("u") is not None:
                u[hinge.u] = hinge.initial["u"]
        return q, u


def _body(data: Mapping[str, Any]) -> Body:
    given = [float(v) for v in data.get("inertia") or (0, 0, 0)]
    xx, yy, zz, xy, xz, yz = given + [0.0] * (6 - len(given))
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    ends = {}
    for name, end in (data.get("ends") or {}).items():
        if isinstance(end, Mapping):
            frame = (np.asarray(end["position"], float), orientation(end.get("orientation")))
        else:
            frame = (np.asarray(end, float), np.eye(3))
        ends[name] = frame
    center = np.asarray(data.get("center_of_mass") or (0, 0, 0), float)
    return Body(data["name"], float(data["mass"]), center, inertia, ends)


def _hinge(data: Mapping[str, Any], tree: Tree, nq: int, nu: int) -> Hinge:
    kind = data["type"]
    size_q, size_u = SIZES[kind]
    parent, ro, inboard = tree.end(data["inboard"], data.get("position"))
    child, rp, outboard = tree.end(data["outboard"])
    driven = data.get("drive")
    if driven is None:
        driven = ["free"] * size_u
    elif not isinstance(driven, (list, tuple)):
        driven = [driven]
    axis = unit(data.get("axis") or (0, 0, 1))
    return Hinge(
        name=data["name"],
        type=kind,
        parent=parent,
        child=child,
        ro=ro,
        Ro=inboard @ orientation(data.get("orientation")),
        rp=rp,
        Rp=outboard,
        axis=axis,
        axis2=unit(data["axis2"]) if data.get("axis2") else triad(axis)[:, 0],
        pitch=float(data.get("lead") or 0.0) / (2 * np.pi),
        law=data.get("law") or {},
        drive=tuple(driven),
        q=slice(nq, nq + size_q),
        u=slice(nu, nu + size_u),
        initial=data.get("initial") or {},
    )


def read(scene: Mapping[str, Any] | Tree) -> Tree:
    """Tree of a scene dictionary; ValueError if a body is not held.

    Hinges whose outboard body is held already close loops: they are not in `order`.
    """
    if isinstance(scene, Tree):
        return scene
    bodies = tuple(_body(b) for b in scene.get("body") or ())
    gravity = np.asarray(scene["gravity"], float)
    loads, springs = tuple(scene.get("load") or ()), tuple(scene.get("spring") or ())
    bare = Tree(bodies, (), (), gravity, loads, springs, 0, 0)
    hinges: list[Hinge] = []
    nq = nu = 0
    for data in scene.get("hinge") or ():
        hinges.append(_hinge(data, bare, nq, nu))
        nq, nu = hinges[-1].q.stop, hinges[-1].u.stop
    order: list[int] = []
    held = {-1}
    while ready := [i for i, h in enumerate(hinges) if h.parent in held and h.child not in held]:
        order.append(ready[0])
        held.add(hinges[ready[0]].child)
    if len(held) != len(bodies) + 1:
        raise ValueError("a body is not held by a hinge")
    return Tree(bodies, tuple(hinges), tuple(order), gravity, loads, springs, nq, nu)
