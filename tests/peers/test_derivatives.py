"""Derivatives and linear models against Pinocchio's analytical derivatives."""

from __future__ import annotations

import numpy as np
import pytest

import mstmm
from tests.reference.compare import seeded_scene, worst
from tests.support.peers.pinocchio_peer import PinocchioPeer

#: Both engines; the second one is code compiled for the scene.
ENGINES = ("looped", "fused")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("seed", [41, 42, 43])
def test_pinocchio_on_chains_of_pins_slides_and_balls(seed: int, engine: str) -> None:
    """By q, along rotation vectors for balls, by u and by efforts."""
    scene, q, u = seeded_scene(
        seed, types=("pin", "prismatic", "ball"), chain=True, most=4, laws=False, loads=False
    )
    found = mstmm.compile(mstmm.Scene(**scene), engine=engine).derivatives(q, u)
    wanted = PinocchioPeer(scene).derivatives(q, u)
    for name, ours, theirs in zip("qut", (found.q, found.u, found.efforts), wanted, strict=True):
        assert worst(ours, theirs) < 1e-12, name


@pytest.mark.parametrize("engine", ENGINES)
def test_pinocchio_on_a_linear_model(engine: str) -> None:
    """The lower half of A in coordinates whose rates are the speeds."""
    scene, q, u = seeded_scene(
        51, types=("pin", "prismatic"), chain=True, most=6, laws=False, loads=False
    )
    linear = mstmm.compile(mstmm.Scene(**scene), engine=engine).linearize(q, u)
    by_q, by_u, inverse = PinocchioPeer(scene).derivatives(q, u)
    assert worst(linear.A[len(u) :], np.hstack([by_q, by_u])) < 1e-12
    assert worst(np.linalg.inv(linear.M), inverse) < 1e-12
