"""mstmm against Pinocchio and MuJoCo: accelerations, mass matrices, inverse dynamics, motions."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from tests.reference.compare import fresh, seeded_scene, worst
from tests.support.models import compile_scene
from tests.support.peers.mujoco_peer import TYPES, MujocoPeer
from tests.support.peers.pinocchio_peer import PinocchioPeer


@pytest.mark.parametrize("draw", range(25))
def test_pinocchio_on_random_trees(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = seeded_scene(draw) if draw < 15 else fresh(rng)
    model, peer = compile_scene(scene), PinocchioPeer(scene)
    assert worst(model.accelerations(q, u, t=0.3), peer.accelerations(q, u, 0.3)) < 1e-9
    assert worst(model.mass_matrix(q), peer.mass_matrix(q)) < 1e-11
    asked = rng.uniform(-2, 2, len(u))
    efforts = model.inverse_dynamics(q, u, asked, 0.3)
    assert worst(efforts, peer.inverse_dynamics(q, u, asked, 0.3)) < 1e-11


@pytest.mark.parametrize("draw", range(25))
def test_mujoco_on_random_trees(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = seeded_scene(draw, types=TYPES) if draw < 15 else fresh(rng, types=TYPES)
    model, peer = compile_scene(scene), MujocoPeer(scene)
    assert worst(model.accelerations(q, u, t=0.3), peer.accelerations(q, u, 0.3)) < 1e-9
    assert worst(model.mass_matrix(q), peer.mass_matrix(q)) < 1e-11


@pytest.mark.parametrize(
    "types", [("pin",), ("ball",), ("universal", "prismatic"), ("cylindrical",)]
)
def test_pinocchio_on_long_chains(types: tuple[str, ...]) -> None:
    scene, q, u = seeded_scene(77, types=types, chain=True, most=40, laws=False, loads=False)
    model, peer = compile_scene(scene), PinocchioPeer(scene)
    assert worst(model.accelerations(q, u), peer.accelerations(q, u)) < 1e-9


def test_motion_of_a_spatial_arm_against_mujoco() -> None:
    """Half a second of a chain of pins, universals and balls; MuJoCo by its own RK4."""
    scene, q, u = seeded_scene(
        9, types=("pin", "ball", "universal"), chain=True, most=4, loads=False, laws=False
    )
    peer, step = MujocoPeer(scene), 1e-4
    peer.model.opt.integrator, peer.model.opt.timestep = mujoco.mjtIntegrator.mjINT_RK4, step
    peer.data.qpos[:], peer.data.qvel[:] = peer.coordinates(q), peer.speeds(u, q)
    for _ in range(5000):
        mujoco.mj_step(peer.model, peer.data)
    result = compile_scene(scene).simulate(
        t_end=0.5, rtol=1e-11, atol=1e-12, initial=(q, u), output_times=[0.0, 0.5]
    )
    assert result.success, result.message
    assert peer.data.qpos == pytest.approx(peer.coordinates(result.q[-1]), abs=1e-7)
    assert peer.data.qvel == pytest.approx(peer.speeds(result.u[-1], result.q[-1]), abs=1e-6)
