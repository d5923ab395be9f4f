"""How many numbers of the motion inboard the loads outboard depend on: nine, not six, and more
beside loads that stand in space.

The tangent Z = M + c_u C + c_q K of a chain comes as a dense matrix from exact derivatives of the
accelerations. Of its rows of hinges outboard of the middle and columns of hinges inboard of it, the
rank is the number of columns of S that a sweep must carry across the middle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.array_validation import Array

Scene = dict[str, Any]

BY_SPEED, BY_PLACE = 0.3, 0.09
#: Singular values beside the largest; what is not there is 1e-16.
THERE = 1e-10


def chain(rng: np.random.Generator, kind: str, count: int, **more: Any) -> Scene:
    """Bodies of any shape, one behind the other."""
    bodies = [
        {"name": f"body{k}", "mass": rng.uniform(0.5, 2.0),
         "center_of_mass": rng.uniform(-0.3, 0.3, 3).tolist(),
         "inertia": rng.uniform(0.05, 0.1, 3).tolist(),
         "ends": {"tip": rng.uniform(-1.0, 1.0, 3).tolist()}}
        for k in range(count)
    ]  # fmt: skip
    return {
        "gravity": [0, -9.81, 0],
        "body": bodies,
        "hinge": serial_hinges(kind, count, "body"),
        **more,
    }


def beams(rng: np.random.Generator) -> Scene:
    """Beams on balls that bend both ways, each a little otherwise."""
    made = [
        {"name": f"beam{k}", "length": rng.uniform(0.8, 1.2), "mass_per_length": 1.0,
         "bending_stiffness": rng.uniform(20.0, 40.0, 2).tolist(), "torsional_stiffness": 10.0,
         "polar_inertia_per_length": 0.1, "modes": {"y": 1, "z": 1}}
        for k in range(6)
    ]  # fmt: skip
    return {"gravity": [0, -9.81, 0], "beam": made, "hinge": serial_hinges("ball", 6, "beam")}


def serial_hinges(kind: str, count: int, stem: str) -> list[Scene]:
    return [
        {"name": f"hinge{k}", "type": kind, "outboard": f"{stem}{k}",
         "inboard": f"{stem}{k - 1}.tip" if k else "ground"}
        for k in range(count)
    ]  # fmt: skip


PUSH = {"on": "body9.tip", "force": [1, 2, 3], "moment": [2, -1, 1]}
SPRING = {"name": "tie", "from": "ground", "to": "body9.tip", "position": [1, 2, 0],
          "law": {"stiffness": 30.0, "rest": 0.2, "damping": 1.0}}  # fmt: skip
#: Scenes, and the ranks of M, C and Z.
SCENES: dict[str, tuple[Callable[[np.random.Generator], Scene], tuple[int, int, int]]] = {
    "balls": (lambda r: chain(r, "ball", 10), (6, 9, 9)),
    "a load that follows": (
        lambda r: chain(r, "ball", 10, load=[PUSH | {"axes": "body"}]), (6, 9, 9),
    ),
    "a load in space": (lambda r: chain(r, "ball", 10, load=[PUSH]), (6, 9, 12)),
    "a spring to the ground": (lambda r: chain(r, "ball", 10, spring=[SPRING]), (6, 10, 12)),
    "pins in a plane": (lambda r: chain(r, "pin", 12), (3, 3, 3)),
    "beams": (beams, (6, 9, 9)),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_columns_that_pass_the_middle(name: str, rng: np.random.Generator) -> None:
    make, wanted = SCENES[name]
    model = mstmm.compile(mstmm.Scene(**make(rng)), engine="looped")
    q, u = state(model, rng), rng.normal(size=model.nu)
    slopes, mass = model.derivatives(q, u), model.mass_matrix(q)
    damping, stiffness = -mass @ slopes.u, -mass @ slopes.q
    tangent = mass + BY_SPEED * damping + BY_PLACE * stiffness
    inboard, outboard = halves(model)
    found = tuple(rank(one[np.ix_(outboard, inboard)]) for one in (mass, damping, tangent))
    assert found == wanted
    assert rank(tangent[np.ix_(inboard, outboard)]) == wanted[0]


def state(model: mstmm.Model, rng: np.random.Generator) -> Array:
    """Coordinates drawn, quaternions of length 1, modes small."""
    q = rng.normal(size=model.nq)
    for first in model.coordinate_layout.quaternions:
        q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
    for modes in model.coordinate_layout.modal.values():
        q[modes.q_slice] *= 1e-2
    return q


def halves(model: mstmm.Model) -> tuple[list[int], list[int]]:
    """Speeds inboard and outboard of the middle hinge, modes with their body."""
    names = model.coordinate_layout.u_names
    number = [int("".join(c for c in name.split(".")[0] if c.isdigit())) for name in names]
    middle = (max(number) + 1) // 2
    return (
        [k for k, n in enumerate(number) if n < middle],
        [k for k, n in enumerate(number) if n >= middle],
    )


def rank(block: Array) -> int:
    values = np.linalg.svd(block, compute_uv=False)
    return int((values > THERE * values[0]).sum())
