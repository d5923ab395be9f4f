"""Pinocchio and MuJoCo against the dense Newton-Euler reference: the builders themselves."""

from __future__ import annotations

import pytest

from tests.reference import newton_euler as dense
from tests.reference.compare import seeded_scene, worst
from tests.support.peers.mujoco_peer import TYPES, MujocoPeer
from tests.support.peers.pinocchio_peer import PinocchioPeer


@pytest.mark.parametrize("seed", range(20))
def test_pinocchio(seed: int) -> None:
    scene, q, u = seeded_scene(seed)
    peer = PinocchioPeer(scene)
    assert worst(peer.accelerations(q, u, 0.3), dense.solve(scene, q, u, 0.3).udot) < 1e-10
    assert worst(peer.mass_matrix(q), dense.mass_matrix(scene, q)) < 1e-11


@pytest.mark.parametrize("seed", range(20))
def test_mujoco(seed: int) -> None:
    scene, q, u = seeded_scene(seed, types=TYPES)
    peer = MujocoPeer(scene)
    assert worst(peer.accelerations(q, u, 0.3), dense.solve(scene, q, u, 0.3).udot) < 1e-9
    assert worst(peer.mass_matrix(q), dense.mass_matrix(scene, q)) < 1e-11


@pytest.mark.parametrize("seed", [1, 4, 5, 10])
@pytest.mark.parametrize("kind", ["free", "elastic"])
def test_mujoco_with_a_free_root(kind: str, seed: int) -> None:
    """Without reflected inertia: MuJoCo's lies along world axes, ours turns with the body."""
    scene, q, u = seeded_scene(seed, types=(kind,), chain=True, most=1)
    scene["hinge"][0].get("law", {}).pop("inertia", None)
    peer = MujocoPeer(scene)
    assert worst(peer.accelerations(q, u, 0.3), dense.solve(scene, q, u, 0.3).udot) < 1e-11
