"""Random mechanisms with closed loops against the dense Newton-Euler equations."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from reference import newton_euler as dense
from reference.compare import worst
from reference.random_loops import random_mechanism

import mstmm

ACCURACY = 1e-11


@pytest.mark.parametrize("seed", range(24))
def test_random_mechanisms(seed: int) -> None:
    """Accelerations, loads and efforts of all hinges, whichever of them are cut."""
    scene, q, u = random_mechanism(seed)
    found = dense.solve(scene, q, u)
    model = mstmm.compile(mstmm.Scene(**copy.deepcopy(scene)))
    assert worst(model.accelerations(q, u), found.udot) < ACCURACY
    assert not model.loops.redundant
    result = model.simulate(t_end=0.0, initial=(q, u))
    assert result.success, result.message
    names = [hinge["name"] for hinge in scene["hinge"]]
    loads = [np.concatenate([result.force(n)[0], result.moment(n)[0]]) for n in names]
    inertia = max(body["mass"] for body in scene["body"]) * np.abs(found.udot).max(initial=0.0)
    wanted = np.hstack([found.force, found.moment])
    assert worst(loads, wanted, floor=max(1.0, inertia)) < ACCURACY
