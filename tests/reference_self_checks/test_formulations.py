"""The independent formulations against each other: dense, absolute coordinates, Kane, balances."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import dae, kane, laws, random_scenes
from tests.reference import newton_euler as dense
from tests.reference.compare import fresh, seeded_scene, worst
from tests.reference.constraints import rows_of
from tests.reference.histories import integrate
from tests.reference.jets import Array
from tests.reference.tree import SIZES, Tree, read

SEEDS = range(12)


@pytest.mark.parametrize("seed", [*SEEDS, -1, -2, -3])
def test_dense_equations_agree_with_multipliers(seed: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng) if seed < 0 else seeded_scene(seed)
    found = dense.solve(scene, q, u, 0.3)
    equations = dae.Equations(scene)
    state = equations.start(q, u)
    other = equations.solve(state, 0.3)
    assert np.abs(other.u - u).max(initial=0.0) < 1e-12
    assert worst(other.udot, found.udot) < 1e-11
    inertia = sum(body["mass"] for body in scene["body"]) * np.abs(found.udot).max(initial=0.0)
    wrenches = np.hstack([found.force, found.moment])  # nothing but rounding at a free hinge
    assert worst(equations.wrenches(state, 0.3), wrenches, floor=1e-3 * inertia) < 1e-11


@pytest.mark.parametrize("kind", [kind for kind in SIZES if kind != "fixed"])
def test_each_hinge_type_alone_and_in_a_chain(kind: str) -> None:
    scene, q, u = seeded_scene(5, types=(kind,), chain=True, most=4)
    equations = dae.Equations(scene)
    found = dense.solve(scene, q, u, 0.1)
    assert worst(equations.solve(equations.start(q, u), 0.1).udot, found.udot) < 1e-11


@pytest.mark.parametrize("seed", SEEDS)
def test_mass_matrix_and_inverse_dynamics_give_the_same_accelerations(seed: int) -> None:
    scene, q, u = seeded_scene(seed)
    tree = read(scene)
    found = dense.solve(tree, q, u, 0.3)
    rest = dense.solve(tree, q, u, 0.3, udot=np.zeros(tree.nu)).effort
    law = [laws.hinge_effort(tree, hinge, q, u, 0.3) for hinge in tree.hinges]
    right = np.concatenate([np.zeros(0), *law]) - rest
    assert worst(np.linalg.solve(dense.mass_matrix(tree, q), right), found.udot) < 1e-9


CHAINS = {
    ("pin", "pin", "pin"): True,
    ("pin", "prismatic", "cylindrical"): True,
    ("screw", "pin"): True,
    ("universal", "screw"): False,
    ("planar", "pin"): False,
    ("universal", "cylindrical"): False,
}


@pytest.mark.parametrize("types", CHAINS, ids="-".join)
def test_dense_equations_agree_with_kane(types: tuple[str, ...]) -> None:
    scene = random_scenes.aligned_chain(11, types, springs=CHAINS[types])
    solve = kane.accelerations(scene)
    for seed in range(3):
        q, u = random_scenes.random_state(scene, seed)
        assert worst(solve(q, u), dense.solve(scene, q, u).udot) < 1e-12


def power(tree: Tree, q: Array, u: Array, t: float, step: float = 1e-6) -> float:
    """Rate of the energy along the motion, by central differences."""
    udot, qdot = dense.solve(tree, q, u, t).udot, dense.coordinate_rates(tree, q, u)
    ahead = dense.energy(tree, q + step * qdot, u + step * udot)
    behind = dense.energy(tree, q - step * qdot, u - step * udot)
    return (ahead - behind) / (2 * step)


@pytest.mark.parametrize("seed", SEEDS)
def test_energy_is_constant_without_damping_and_loads(seed: int) -> None:
    scene, q, u = seeded_scene(seed)
    scene["load"] = []
    for spring in scene["spring"]:
        spring["law"].pop("damping")
    for hinge in scene["hinge"]:
        for key in ("damping", "effort", "friction"):
            hinge.get("law", {}).pop(key, None)
        for stop in hinge.get("law", {}).get("limits", []):
            stop["damping"] = 0.0
    scale = abs(dense.energy(scene, q, u)) + 1.0
    assert abs(power(read(scene), q, u, 0.0)) < 1e-7 * scale


def test_momentum_of_a_floating_tree_is_constant() -> None:
    scene = random_scenes.floating_tree(21)
    q, u = random_scenes.random_state(scene, 3)
    udot, qdot, step = dense.solve(scene, q, u).udot, dense.coordinate_rates(scene, q, u), 1e-6
    ahead = np.concatenate(dense.momentum(scene, q + step * qdot, u + step * udot))
    behind = np.concatenate(dense.momentum(scene, q - step * qdot, u - step * udot))
    assert np.abs(ahead - behind).max() / (2 * step) < 1e-7 * np.abs(ahead).max()


def test_driven_coordinates_follow_and_their_efforts_agree() -> None:
    scene, q, u = seeded_scene(
        2, types=("pin", "cylindrical", "planar", "universal"), chain=True, most=4
    )
    for hinge in scene["hinge"]:
        count = SIZES[hinge["type"]][1]
        hinge["drive"] = ["0.3*sin(2*t)^2 + 0.1*exp(-t)"] + ["free"] * (count - 1)
    tree = read(scene)
    dense.fill_driven(tree, q, u, 0.4)
    found = dense.solve(tree, q, u, 0.4)
    equations = dae.Equations(tree)
    state = equations.start(q, u)
    assert worst(equations.solve(state, 0.4).udot, found.udot) < 1e-11
    assert worst(equations.wrenches(state, 0.4), np.hstack([found.force, found.moment])) < 1e-11


@pytest.mark.parametrize("types", [("pin", "ball"), ("universal", "free"), ("cylindrical",)])
def test_histories_agree(types: tuple[str, ...]) -> None:
    scene, q, u = seeded_scene(4, types=types, chain=True, most=2, loads=False)
    times = np.linspace(0.0, 0.03, 3)
    found_q, found_u = integrate(scene, times, q, u, tolerance=1e-10)
    other = dae.simulate(scene, times, q, u, rtol=1e-10, atol=1e-10)
    assert np.abs(other.q - found_q).max() < 2e-8
    assert np.abs(other.u - found_u).max() < 2e-7
    assert other.constraint < 1e-8


def test_a_wrong_sign_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison has teeth: a flipped Coriolis term in one formulation is seen at once."""
    scene, q, u = seeded_scene(1)
    good = dense.solve(scene, q, u, 0.3).udot
    equations = dae.Equations(scene)
    monkeypatch.setattr(dae, "rows_of", lambda jet, bias, p: rows_of(jet, -bias, p))
    assert worst(equations.solve(equations.start(q, u), 0.3).udot, good) > 1e-3
