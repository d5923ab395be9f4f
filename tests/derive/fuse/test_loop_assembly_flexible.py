"""Code for one scene whose loops close through flexible bodies: what the looped engine does."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.reference.compare import worst
from tests.reference.flexible import random_beams
from tests.support.models import compile_scene, looped_model
from tests.system.loops.test_flexible_against_particles import closed_scene
from tests.system.loops.test_flexible_against_tree import SCENES, shackled_beam, slider_crank
from tests.system.loops.test_flexible_constraints import ROWS, blade_model

from .test_loop_assembly import AGREEMENT, TIME, interpreted_outputs, start_state


def agree(model: mstmm.Model, rng: np.random.Generator) -> None:
    """The accelerations of a state and those of IR with plain floats."""
    q, u = model.initial_state()
    u = u + rng.normal(scale=0.3, size=model.nu)
    found, wanted = interpreted_outputs(model, q, u), model.accelerations(q, u, TIME)
    assert worst(np.array(found["udot"]), wanted) < 1e-11


@pytest.mark.parametrize("name", SCENES)
def test_loops_of_hinges(name: str, rng: np.random.Generator) -> None:
    """Rows that pass a body, end on it, and close on its own frame."""
    agree(looped_model(SCENES[name][0]()), rng)


@pytest.mark.parametrize("name", ROWS)
def test_constraints_and_couplings(name: str, rng: np.random.Generator) -> None:
    closing, ring, _ = ROWS[name]
    agree(blade_model(ring, **closing), rng)


@pytest.mark.parametrize("seed", [101, 118, 138])
def test_random_chains(seed: int, rng: np.random.Generator) -> None:
    """Any frame, any end held, sections within."""
    tree = random_beams.random_system(seed, most=3, chain=True)
    agree(looped_model(closed_scene(tree, seed)[0]), rng)


@pytest.fixture(scope="module", params=[slider_crank, shackled_beam], ids=["crank", "shackle"])
def looped_and_fused(request: pytest.FixtureRequest) -> tuple[mstmm.Model, mstmm.Model]:
    """Models of a scene with loops: by the looped engine, and by code compiled for it."""
    scene = request.param()
    return looped_model(scene), compile_scene(scene, "fused")


@pytest.mark.parametrize("away", [1e-9, 1e-6, 1e-4])
def test_loops_are_closed_alike(
    away: float, looped_and_fused: tuple[mstmm.Model, mstmm.Model], rng: np.random.Generator
) -> None:
    """Bodies bend by their inertia there, in both."""
    looped, fused = looped_and_fused
    q, u = looped.initial_state()
    near = q + away * rng.normal(size=looped.nq), u + away * rng.normal(size=looped.nu)
    wanted = start_state(looped, *near)
    assert np.abs(wanted - np.concatenate(near)).max() > 0.1 * away
    assert np.abs(start_state(fused, *near) - wanted).max() < 10 * AGREEMENT


def test_runs_and_batches(looped_and_fused: tuple[mstmm.Model, mstmm.Model]) -> None:
    looped, fused = looped_and_fused
    wanted = looped.simulate(0.1, "rk4", step=5e-4, output_times=[0.05, 0.1])
    found = fused.simulate(0.1, "rk4", step=5e-4, output_times=[0.05, 0.1])
    assert found.success and np.abs(found.q - wanted.q).max() < 1e-11
    assert np.abs(found.energy() - wanted.energy()).max() < 1e-11
    q, u = looped.initial_state()
    batch = fused.simulate_batch(
        (np.tile(q, (3, 1)), np.tile(u, (3, 1))), t_end=0.1, method="rk4", step=5e-4
    )
    assert "side by side" in batch.engine and batch.success.all()
    assert np.abs(batch.q[:, -1] - wanted.q[-1]).max() < 1e-11
