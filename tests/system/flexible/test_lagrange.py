"""A free beam against Lagrange's equations, made by SymPy from exact integrals of its energies."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.algebra import to_quaternion
from tests.reference.compare import worst
from tests.reference.flexible import dense, lagrange
from tests.reference.jets import Array

Scene = dict[str, Any]


def scene_of(planar: bool, stiffening: bool, rotary: bool) -> Scene:
    """A beam with polynomial shapes in every direction, its root section free."""
    shapes = {"y": ["(1.0)*x^2", "(0.5)*x^2 + (-0.3)*x^3"]}
    beam: Scene = {
        "name": "beam",
        "length": 1.5,
        "mass_per_length": 0.8,
        "bending_stiffness": [7.5, 4.0],
        "stiffening": stiffening,
        "frame": "tangent",
        "quadrature": False,
        "shapes": shapes,
    }
    if not planar:
        shapes |= {"z": ["(0.7)*x^2"], "twist": ["(1.0)*x^1"], "axial": ["(1.0)*x^1"]}
        beam |= {"torsional_stiffness": 3.0, "axial_stiffness": 40.0}
    if rotary:
        beam["rotary_inertia"] = [0.02, 0.03]
    else:
        beam["polar_inertia_per_length"] = 0.05
    hinge = {"name": "root", "type": "free", "inboard": "ground", "outboard": "beam"}
    gravity = [1.0, -9.0, 0.0 if planar else 2.0]
    return {"gravity": gravity, "beam": [beam], "hinge": [hinge]}


@cache
def equations(planar: bool, stiffening: bool, rotary: bool) -> lagrange.FreeBeam:
    scene = scene_of(planar, stiffening, rotary)
    return lagrange.FreeBeam(lagrange.beam_of(scene["beam"][0]), planar, scene["gravity"])


def draw(form: lagrange.FreeBeam, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """q, u of the scene at a random state, and udot by Lagrange's equations."""
    k = 3 if form.planar else 6
    q, qd = rng.uniform(-1, 1, k + form.n), rng.uniform(-1, 1, k + form.n)
    q[k:] *= 0.004  # beyond, a mass matrix cut after the second order need not be definite
    qdd = form.accelerations(q, qd)
    A, w, alpha = form.angular(q, qd, qdd)
    place, velocity, acceleration = (np.zeros(3) for _ in range(3))
    size = k // 3 + 1
    for vector, values in ((place, q), (velocity, qd), (acceleration, qdd)):
        vector[:size] = values[:size]
    v = A.T @ velocity
    return (
        np.concatenate([place, to_quaternion(A), q[k:]]),
        np.concatenate([v, w, qd[k:]]),
        np.concatenate([A.T @ acceleration - np.cross(w, v), alpha, qdd[k:]]),
    )


@pytest.mark.parametrize(
    ("planar", "stiffening", "rotary"),
    [(True, True, True), (True, False, False), (False, True, True), (False, False, False)],
)
def test_free_beam(planar: bool, stiffening: bool, rotary: bool, rng: np.random.Generator) -> None:
    form = equations(planar, stiffening, rotary)
    scene = scene_of(planar, stiffening, rotary)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    body = dense.system(scene).bodies[0]
    for _ in range(5):
        q, u, udot = draw(form, rng)
        # As forces, since the accelerations of an ill-conditioned mass matrix lose more digits.
        M = dense.mass_matrix(body, q[7:], True)
        for found in (model.accelerations(q, u), dense.solve(scene, q, u).udot):
            assert worst(M @ found, M @ udot) < 1e-13
            assert worst(found, udot) < 1e-11


def test_a_wrong_sign_is_seen(rng: np.random.Generator) -> None:
    """The comparison fails for a beam whose shortening has the other sign."""
    form = equations(True, True, True)
    q, u, udot = draw(form, rng)
    scene = scene_of(True, False, True)
    assert worst(mstmm.compile(mstmm.Scene(**scene)).accelerations(q, u), udot) > 1e-4
