"""The fastest motion of laws and modes against eigenvalues of the whole scene."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from benchmarks.stiff.cases import CASES
from mstmm.runtime.engine.jacobian import fastest_eigenvalue
from mstmm.runtime.run.spectral_radius import FastestMode, fastest_at_start
from tests.reference import random_scenes
from tests.reference.jets import Array
from tests.reference.tree import read
from tests.support.scenes.results import pins
from tests.system.loops.test_flexible_against_tree import slider_crank

TREES, STIFF = 200, 300.0


def stiff_tree(seed: int) -> tuple[mstmm.Model, Array, Array]:
    """A random tree near the rest of its laws, whose numbers spread over decades."""
    scene, rng = random_scenes.random_scene(seed), np.random.default_rng(seed)
    for hinge in scene["hinge"]:
        law: dict[str, Any] = hinge.get("law", {})
        factors = {"stiffness": 10 ** rng.uniform(1, 7), "damping": 10 ** rng.uniform(0, 3)}
        for key, factor in factors.items():
            if key in law:
                law[key] = [factor * value for value in law[key]]
        law.pop("rest", None)
        law.pop("effort", None)
    q, u = random_scenes.random_state(scene, seed)
    q, u = 1e-4 * q, 1e-3 * u
    for hinge in read(scene).hinges:
        if hinge.type in ("ball", "free", "elastic"):
            q[hinge.q.stop - 4] = 1.0
    return mstmm.compile(mstmm.Scene(**scene), engine="looped"), q, u


def estimated_and_exact_radius(model: mstmm.Model, q: Array, u: Array) -> tuple[float, float]:
    """|lambda| by power iterations of the laws alone, and of the dense matrix of everything."""
    memory = model.looped.start_memory()
    value, _ = fastest_eigenvalue(model.looped, 0.3, np.concatenate([q, u]), memory)
    return FastestMode(model.looped, memory).rate(0.3, q, u), abs(value)


def test_stiff_random_trees() -> None:
    ratios = []
    for seed in range(TREES):
        model, q, u = stiff_tree(seed)
        found, exact = estimated_and_exact_radius(model, q, u) if model.nu else (0.0, 0.0)
        if exact > STIFF:
            ratios.append(found / exact)
    assert len(ratios) > TREES / 2
    assert min(ratios) > 0.75 and max(ratios) < 1.25
    assert np.quantile(ratios, 0.1) > 0.9


@pytest.mark.parametrize(
    "name", ["a10-1e8", "a10-1e8-critical", "b8", "b8-damped", "d-quarter", "f"]
)
def test_stiff_scenes(name: str) -> None:
    """Bushings, beams with and without damping, springs between bodies and dampers."""
    model = mstmm.compile(mstmm.Scene(**CASES[name].scene()), engine="looped")
    found, exact = estimated_and_exact_radius(model, *model.initial_state())
    assert 0.85 * exact < found < 1.1 * exact
    assert 0.85 * exact < fastest_at_start(model.looped, 0.0, *model.initial_state()) < 1.1 * exact


def test_a_beam_within_a_closed_loop() -> None:
    """Against eigenvalues of differences of the accelerations, by which a step is chosen."""
    scene = slider_crank(stiffness=3e5)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    (q, u), size = model.initial_state(), 1e-6
    found = fastest_at_start(model.looped, 0.0, q, u)
    moved = size * np.eye(model.nq)
    by_q, by_u = (
        (model.accelerations(q + a, u + b) - model.accelerations(q - a, u - b)).T / (2 * size)
        for a, b in ((moved, 0 * moved), (0 * moved, moved))
    )
    rates = np.block([[0 * moved, np.eye(model.nq)], [by_q, by_u]])
    assert found == pytest.approx(np.abs(np.linalg.eigvals(rates)).max(), rel=0.1)
    reached = model.simulate(0.02, error=1e-3).achieved_error
    assert reached is not None and reached.is_met


def test_many_bodies_cost_no_more_columns() -> None:
    """Of a long chain the light rod with the stiff spring is found although few are looked at."""
    scene = pins(150, [0.1] * 150, stiffness=10.0).model_dump(mode="json")
    scene["hinge"][97]["law"]["stiffness"] = [1e7]
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found, exact = estimated_and_exact_radius(model, *model.initial_state())
    assert 0.85 * exact < found < 1.1 * exact


def test_released_and_driven_speeds() -> None:
    """A stiff spring counts once its hinge is released, and not while a drive holds it."""
    scene = pins(2, [0.3, 0.2]).model_dump(mode="json")
    scene["hinge"][1]["law"] = {"stiffness": [1e6], "rest": [0.2]}
    scene["hinge"][1] |= {"drive": "0.2", "release": "t >= 1", "initial": {}}
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    q, u = model.initial_state()
    memory = model.looped.start_memory()
    held = FastestMode(model.looped, memory)
    before = held.rate(0.3, q, u)
    memory[:] = 1.0
    after = held.rate(0.3, q, u)
    value, _ = fastest_eigenvalue(model.looped, 0.3, np.concatenate([q, u]), memory)
    assert before < 10.0
    assert after == pytest.approx(abs(value), rel=0.05)


def test_nothing_that_moves() -> None:
    welded = pins(1, [0.0]).model_dump(mode="json")
    welded["hinge"][0] = {"name": "w", "type": "fixed", "inboard": "ground", "outboard": "rod0"}
    for scene in (mstmm.Scene(**welded), mstmm.Scene(**welded | {"gravity": [0, 0, 0]})):
        model = mstmm.compile(scene, engine="looped")
        found = FastestMode(model.looped, model.looped.start_memory())
        assert found.rate(0.0, *model.initial_state()) == 0.0
        assert fastest_at_start(model.looped, 0.0, *model.initial_state()) == 0.0
