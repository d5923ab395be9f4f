"""The engine against the dense Newton-Euler equations and against Kane's, on random scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.reference import kane, laws, random_scenes
from tests.reference import newton_euler as dense
from tests.reference.compare import fresh, seeded_scene, worst
from tests.reference.jets import Array
from tests.reference.tree import SIZES, read
from tests.support.models import compile_scene

ACCURACY = 1e-11
TIME = 0.3


def compare(scene: dict[str, Any], q: Array, u: Array) -> None:
    """Accelerations, hinge loads, efforts, energy and momentum of one state."""
    model, found = compile_scene(scene), dense.solve(scene, q, u, TIME)
    assert worst(model.accelerations(q, u, t=TIME), found.udot) < ACCURACY
    result = model.simulate(t_start=TIME, t_end=TIME, initial=(q, u))
    assert result.success, result.message
    names = [hinge["name"] for hinge in scene["hinge"]]
    wrenches = [np.concatenate([result.force(n)[0], result.moment(n)[0]]) for n in names]
    loads = np.hstack([found.force, found.moment])
    # Loads and efforts are what is left of inertia forces, which may be a million times larger.
    inertia = max(body["mass"] for body in scene["body"]) * np.abs(found.udot).max(initial=0.0)
    assert worst(wrenches, loads, floor=max(1.0, inertia)) < ACCURACY
    energy = dense.energy(scene, q, u)
    assert abs(result.energy()[0] - energy) < ACCURACY * max(np.abs(loads).max(), abs(energy), 1.0)
    rotors = np.concatenate([laws.reflected_inertia(hinge) for hinge in read(scene).hinges])
    efforts = np.concatenate([result.effort(n)[0] for n in names])
    put_in = found.effort + rotors * found.udot  # a rotor takes its share before the hinge
    largest = max(inertia, np.abs(loads).max(initial=1.0))
    assert worst(efforts, put_in, floor=largest) < ACCURACY


@pytest.mark.parametrize("seed", range(30))
def test_random_trees(seed: int) -> None:
    compare(*seeded_scene(seed))


@pytest.mark.parametrize("draw", range(15))
def test_random_trees_drawn_afresh(draw: int, rng: np.random.Generator) -> None:
    compare(*fresh(rng))


@pytest.mark.parametrize("kind", SIZES)
def test_chains_of_one_type(kind: str, rng: np.random.Generator) -> None:
    compare(*fresh(rng, types=(kind,), chain=True, most=5))


@pytest.mark.parametrize("seed", range(40, 50))
def test_mass_matrix(seed: int) -> None:
    scene = random_scenes.random_scene(seed)
    q, _ = random_scenes.random_state(scene, seed)
    assert worst(compile_scene(scene).mass_matrix(q), dense.mass_matrix(scene, q)) < ACCURACY


@pytest.mark.parametrize("seed", range(50, 60))
def test_forward_after_inverse_dynamics_is_the_identity(
    seed: int, rng: np.random.Generator
) -> None:
    scene = random_scenes.random_scene(seed)
    q, u = random_scenes.random_state(scene, seed)
    model = compile_scene(scene)
    asked = rng.uniform(-2, 2, len(u))
    efforts = model.inverse_dynamics(q, u, asked, TIME)
    again = model.accelerations(q, u, TIME, efforts)
    # Heavy bodies on light ones lose digits in proportion to the ratio of their efforts.
    assert np.abs(again - asked).max(initial=0.0) < 1e-10


@pytest.mark.parametrize("seed", range(60, 66))
def test_driven_coordinates(seed: int) -> None:
    types = ("pin", "cylindrical", "planar", "universal", "gimbal", "screw", "prismatic")
    scene = random_scenes.random_scene(seed, types=types, most=5)
    for number, hinge in enumerate(scene["hinge"]):
        count = SIZES[hinge["type"]][1]
        if number % 2 == 0:
            hinge["drive"] = ["0.3*sin(2*t)^2 + 0.1*exp(-t)"] + ["free"] * (count - 1)
    q, u = random_scenes.random_state(scene, seed)
    dense.fill_driven(scene, q, u, TIME)
    compare(scene, q, u)


CHAINS = {
    ("pin", "pin", "pin"): True,
    ("prismatic", "pin", "cylindrical"): True,
    ("pin", "screw"): True,
    ("universal", "pin"): False,
    ("planar", "pin"): False,
}


@pytest.mark.parametrize("types", CHAINS, ids="-".join)
def test_kane(types: tuple[str, ...]) -> None:
    scene = random_scenes.aligned_chain(5, types, springs=CHAINS[types])
    solve, model = kane.accelerations(scene), compile_scene(scene)
    for seed in range(3):
        q, u = random_scenes.random_state(scene, seed)
        assert worst(model.accelerations(q, u), solve(q, u)) < 1e-12
