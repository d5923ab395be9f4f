"""The tangent by inertia and laws alone, against the dense matrix that it stands for.

Its parts come from elsewhere: inertia from directions of accelerations, laws from the difference
that the same scene without them makes to the exact tangent, modes from their matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.runtime.engine.tangent_matrix import TangentMatrix
from tests.reference import random_scenes
from tests.reference.jets import Array
from tests.support.draws import draws
from tests.support.scenes import random_flexible as engine_scenes

TIME = 0.3
S, SQ = 200.0, 260.0
UNIT = 2.0**-53

Scene = dict[str, Any]


def without(scene: Scene, *keys: str) -> Scene:
    """Laws without some of their entries."""
    found = deepcopy(scene)
    for hinge in found["hinge"]:
        hinge["law"] = {k: v for k, v in hinge.get("law", {}).items() if k not in keys}
        if not hinge["law"]:
            del hinge["law"]
    return found


def model_and_tangent(scene: Scene) -> tuple[mstmm.Model, TangentMatrix]:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    return model, TangentMatrix(model.looped)


def changes(
    scene: Scene, q: Array, u: Array, a: Array, steps: Sequence[tuple[Array, ...]]
) -> Array:
    """Columns: change of the residual along each (d_q, d_u, d_a)."""
    _, tangent = model_and_tangent(scene)
    tangent.residual(TIME, q, u, a)
    columns = [tangent.slope(0.0, *step) for step in steps]
    return np.asarray(np.array(columns).reshape(len(steps), tangent.nu).T)


def symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2


def stands_for(scene: Scene, q: Array, u: Array, a: Array) -> Array:
    """S M plus the symmetric part of what laws and modes add."""
    model, tangent = model_and_tangent(scene)
    units, still_q, still = np.eye(model.nu), np.zeros(model.nq), np.zeros(model.nu)
    mass = changes(scene, q, u, a, [(still_q, still, unit) for unit in units])
    along = [(tangent.rates(q, unit) / SQ, unit, still) for unit in units]
    bare = without(scene, "stiffness", "rest", "damping", "friction", "limits")
    laws = changes(scene, q, u, a, along) - changes(bare, q, u, a, along)
    found = S * mass + symmetric(laws)
    packed = model.looped.packed
    for name, body in packed.flexible.items():
        at = packed.layout.modal[name].u_slice
        found[at, at] += body.D + body.K / SQ
    return np.asarray(found)


def check(scene: Scene, q: Array, u: Array, rng: Generator) -> None:
    scene = without(scene, "effort")  # an expression of the state is no slope of a law
    model, tangent = model_and_tangent(scene)
    a, right = rng.normal(size=model.nu), rng.normal(size=model.nu)
    matrix = stands_for(scene, q, u, a)
    rows = np.flatnonzero(np.abs(matrix).max(axis=1, initial=0.0) > 0)
    free, expected = matrix[np.ix_(rows, rows)], np.zeros(model.nu)
    expected[rows] = np.linalg.solve(free, right[rows])
    tangent.residual(TIME, q, u, a)
    tangent.factor_laws(S, SQ)
    found = tangent.solve(right)
    size = np.sqrt(np.abs(np.diag(free)))
    condition = float(np.linalg.cond(free / np.outer(size, size))) if len(rows) else 1.0
    gap = float(np.abs(found - expected).max(initial=0.0))
    assert gap <= max(1e-12, 100 * UNIT * condition) * np.abs(expected).max(initial=0.0)


@pytest.mark.parametrize("most", [8] * 16 + [60] * 6)
def test_solution_of_rigid_trees(most: int, rng: Generator) -> None:
    """Every hinge, laws with friction and stops, reflected inertia; one tile of bodies, or many."""
    seed = int(rng.integers(2**32))
    print(f"random_scenes seed = {seed}")
    scene = random_scenes.random_scene(seed, most=most)
    check(scene, *random_scenes.random_state(scene, seed), rng)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("draw", draws(4, 10))
def test_solution_of_flexible_trees(draw: int, rng: Generator) -> None:
    check(*engine_scenes.seeded_scene(int(rng.integers(2**32)), draw % 2 == 0, 3), rng)
