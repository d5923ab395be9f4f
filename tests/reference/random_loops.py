"""Random mechanisms: a random tree in a random state, and hinges that close loops right there.

A closing hinge is drawn with coordinates of its own; the end of its outboard body is put where the
hinge then ends.  Speeds are brought to those that no loop tears apart.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import scipy.linalg

from .algebra import tilde, to_quaternion
from .jets import Array
from .newton_euler import motion, relative
from .random_scenes import random_hinge, random_law, random_scene, random_state
from .tree import SIZES, Hinge, Tree, read

Scene = dict[str, Any]

#: What closes loops, the rarer what takes many freedoms away.
CLOSING = ("ball", "ball", "universal", "cylindrical", "gimbal", "planar", "pin", "prismatic")


def random_mechanism(
    seed: int, most: int = 8, loops: int = 3, laws: bool = True
) -> tuple[Scene, Array, Array]:
    """(scene, q, u) with consistent speeds, and q as the scene's start; the closing hinges are the
    last of the scene."""
    rng = np.random.default_rng(seed)
    kinds = ("pin", "ball", "universal", "cylindrical", "prismatic", "screw", "planar", "free")
    scene = random_scene(seed, most, types=kinds, laws=laws, loads=laws)
    q, u = random_state(scene, seed)
    count = len(scene["hinge"])
    for number in range(3 * loops):
        kind, pair = str(rng.choice(CLOSING)), _pair(scene, rng)
        if pair is None:
            break
        tried = copy.deepcopy(scene)
        more = _close(tried, q, rng, f"closing{number}", kind, *pair, laws=laws)
        if _far_from_singular(read(tried), more) and len(scene["hinge"]) < count + loops:
            scene, q = tried, more
    tree = read(scene)
    u = np.concatenate([u, rng.uniform(-1, 1, tree.nu - len(u))])
    for data, hinge in zip(scene["hinge"], tree.hinges, strict=True):
        if SIZES[hinge.type][0]:
            data["initial"] = {"q": [float(x) for x in q[hinge.q]]}
    return scene, q, consistent(tree, q, u)


def _pair(scene: Scene, rng: np.random.Generator) -> tuple[str, str] | None:
    """Two bodies, or the ground and one, that no hinge joins already."""
    names = ["ground", *(body["name"] for body in scene["body"])]
    joined = {
        frozenset((hinge["inboard"].partition(".")[0], hinge["outboard"].partition(".")[0]))
        for hinge in scene["hinge"]
    }
    pairs = [
        (a, b) for a in names for b in names[1:]
        if a != b and frozenset((a, b)) not in joined
    ]  # fmt: skip
    return pairs[int(rng.integers(len(pairs)))] if pairs else None


def _close(
    scene: Scene, q: Array, rng: np.random.Generator, name: str, kind: str, inboard: str,
    outboard: str, laws: bool,
) -> Array:  # fmt: skip
    """Adds a hinge between two bodies; returns q with its coordinates."""
    start = inboard if inboard == "ground" else f"{inboard}.turned"
    body = next(body for body in scene["body"] if body["name"] == outboard)
    body["ends"][name] = {"position": [0.0, 0.0, 0.0], "orientation": [0.0, 0.0, 0.0]}
    hinge = random_hinge(rng, name, kind, start, f"{outboard}.{name}")
    if laws and rng.random() < 0.7:
        hinge["law"] = random_law(rng, kind)
    before = motion(read(scene), q, np.zeros(read(scene).nu))
    scene["hinge"].append(hinge)
    tree = read(scene)
    closing = tree.hinges[-1]
    own = rng.uniform(-1.0, 1.0, SIZES[kind][0])
    if kind == "ball":
        own /= np.linalg.norm(own)
    q = np.concatenate([q, own])
    rel = relative(closing, q, np.zeros(tree.nu))
    frame = before.A[closing.parent] @ closing.Ro
    place = before.point(closing.parent, closing.ro) + frame @ rel.d
    own_axes = before.A[closing.child]
    turned = own_axes.T @ frame @ rel.R @ closing.Rp.T
    body["ends"][name] = {
        "position": [float(x) for x in own_axes.T @ (place - before.r[closing.child])],
        "orientation": [float(x) for x in to_quaternion(turned)],
    }
    return q


def _far_from_singular(tree: Tree, q: Array) -> bool:
    """Whether no row of the loops repeats others, or nearly."""
    shares = scipy.linalg.svdvals(closure_jacobian(tree, q))
    return bool(shares[-1] > 1e-2 * shares[0]) and tree.nu > len(shares)


def closure_jacobian(tree: Tree, q: Array) -> Array:
    """Velocities of unit speeds between the two sides of the cuts: six rows a closing hinge.

    Those of the outboard ends against those that the closing hinges give them, a column a speed.
    """
    at = motion(tree, q, np.zeros(tree.nu))
    v, w = (np.zeros((len(tree.bodies) + 1, 3, tree.nu)) for _ in range(2))

    def outboard_velocity(hinge: Hinge) -> tuple[Array, Array]:
        """Velocity and angular velocity of the outboard end, by the inboard body and the hinge."""
        rel = relative(hinge, q, np.zeros(tree.nu))
        frame, rates = at.A[hinge.parent] @ hinge.Ro, np.zeros((6, tree.nu))
        rates[:, hinge.u] = rel.B
        arm = at.A[hinge.parent] @ hinge.ro + frame @ rel.d
        speed = v[hinge.parent] - tilde(arm) @ w[hinge.parent] + frame @ rates[:3]
        return speed, w[hinge.parent] + frame @ rates[3:]

    for hinge in (tree.hinges[number] for number in tree.order):
        speed, w[hinge.child] = outboard_velocity(hinge)
        v[hinge.child] = speed + tilde(at.A[hinge.child] @ hinge.rp) @ w[hinge.child]
    found = []
    for hinge in _closing(tree):
        speed, spin = outboard_velocity(hinge)
        own = v[hinge.child] - tilde(at.A[hinge.child] @ hinge.rp) @ w[hinge.child]
        found += [speed - own, spin - w[hinge.child]]
    return np.concatenate(found)


def _closing(tree: Tree) -> list[Hinge]:
    return [hinge for number, hinge in enumerate(tree.hinges) if number not in tree.order]


def consistent(tree: Tree, q: Array, u: Array) -> Array:
    """The nearest speeds at which no loop is torn apart."""
    if not _closing(tree):
        return u
    free = scipy.linalg.null_space(closure_jacobian(tree, q), rcond=1e-10)
    return np.asarray(free @ (free.T @ u))
