"""Pinocchio and MuJoCo against the dense Newton-Euler reference: the builders themselves."""

from __future__ import annotations

import numpy as np
import pytest
from reference import newton_euler as dense
from reference import random_scenes

from peers.mujoco_peer import TYPES, MujocoPeer
from peers.pinocchio_peer import PinocchioPeer


def worst(a, b):
    """Largest difference over the largest entry."""
    a, b = np.asarray(a), np.asarray(b)
    return float(np.abs(a - b).max() / max(np.abs(b).max(), 1e-300)) if b.size else 0.0


def drawn(seed, **options):
    scene = random_scenes.random_scene(seed, **options)
    return scene, *random_scenes.random_state(scene, seed + 1)


@pytest.mark.parametrize("seed", range(20))
def test_pinocchio(seed):
    scene, q, u = drawn(seed)
    peer = PinocchioPeer(scene)
    assert worst(peer.accelerations(q, u, 0.3), dense.solve(scene, q, u, 0.3).udot) < 1e-10
    assert worst(peer.mass_matrix(q), dense.mass_matrix(scene, q)) < 1e-11


@pytest.mark.parametrize("seed", range(20))
def test_mujoco(seed):
    scene, q, u = drawn(seed, types=TYPES)
    peer = MujocoPeer(scene)
    assert worst(peer.accelerations(q, u, 0.3), dense.solve(scene, q, u, 0.3).udot) < 1e-9
    assert worst(peer.mass_matrix(q), dense.mass_matrix(scene, q)) < 1e-11


@pytest.mark.parametrize("kind", ["free", "elastic"])
def test_mujoco_with_a_free_root(kind):
    scene, q, u = drawn(3, types=(kind,), chain=True, most=1)
    peer = MujocoPeer(scene)
    assert worst(peer.accelerations(q, u, 0.3), dense.solve(scene, q, u, 0.3).udot) < 1e-11
