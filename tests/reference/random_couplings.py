"""Random mechanisms whose hinges are coupled: gears with bends in them, and rows of speeds."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg

from . import couplings
from .expressions import evaluate
from .jets import Array
from .random_loops import closure_jacobian, random_mechanism
from .tree import SIZES, Tree, read

Scene = dict[str, Any]
#: Coordinates that are no entries of a quaternion, so many of a hinge.
_ANGLES = {"pin": 1, "prismatic": 1, "screw": 1, "cylindrical": 2, "universal": 2, "planar": 3,
           "gimbal": 3, "free": 3}  # fmt: skip


def random_coupled(seed: int, most: int = 7) -> tuple[Scene, Array, Array]:
    """(scene, q, u) as `random_mechanism`, with up to three couplings that hold there."""
    scene, q, u = random_mechanism(seed, most, loops=2)
    rng, tree = np.random.default_rng(1000 + seed), read(scene)
    scene["coupling"] = []
    for _ in range(6):
        tried = [*scene["coupling"], _coupling(rng, scene, tree, q)]
        if len(tried) < 4 and _has_independent_rows(tree, q, tried):
            scene["coupling"] = tried
    return scene, q, _consistent(tree, q, u, scene["coupling"])


def _coupling(rng: np.random.Generator, scene: Scene, tree: Tree, q: Array) -> Scene:
    speeds = [f"{h['name']}.u[{k}]" for h in scene["hinge"] for k in range(SIZES[h["type"]][1])]
    angles = [
        f"{h['name']}.q[{k}]" for h in scene["hinge"] for k in range(_ANGLES.get(h["type"], 0))
    ]
    a, b, c = (round(float(x), 3) for x in rng.uniform(0.4, 1.4, 3))
    if rng.random() < 0.4 or not angles:
        one, other = (str(x) for x in rng.choice(speeds, 2))
        bent = f"cos({rng.choice(angles)})" if angles else "1"
        equals = f"{c}*cos(t)" if rng.random() < 0.5 else 0
        return {"speeds": f"{a}*{one} - {bent}*{b}*{other}", "equals": equals}
    one, other, third = (str(x) for x in rng.choice(angles, 3))
    text = f"{a}*{one} + {b}*sin({other}) - {c}*{third}*{one}"
    scope = {f"{h.name}.q": q[h.q] for h in tree.hinges}
    value = float(evaluate(text, scope))
    return {"expression": text, "equals": f"{value!r} + {c}*sin(t)"}


def _rows(tree: Tree, q: Array, drawn: list[Scene]) -> Array:
    rows = couplings.rows(drawn, tree, q, np.zeros(tree.nu))[0]
    return (
        np.vstack([closure_jacobian(tree, q), rows])
        if len(tree.hinges) > len(tree.bodies)
        else rows
    )


def _has_independent_rows(tree: Tree, q: Array, drawn: list[Scene]) -> bool:
    """Whether no row repeats others, or nearly, and freedoms are left."""
    rows = _rows(tree, q, drawn)
    shares = scipy.linalg.svdvals(rows)
    return len(rows) < tree.nu and bool(shares[-1] > 1e-2 * shares[0])


def _consistent(tree: Tree, q: Array, u: Array, drawn: list[Scene]) -> Array:
    """The nearest speeds at which loops and couplings hold."""
    if not drawn:
        return u
    rows = _rows(tree, q, drawn)
    lacks = np.zeros(len(rows))
    lacks[-len(drawn) :] = couplings.rows(drawn, tree, q, np.zeros(tree.nu))[2]
    return u - np.linalg.pinv(rows) @ (rows @ u + lacks)
